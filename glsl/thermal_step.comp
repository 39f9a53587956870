#version 450
// One tick of every node of a range: the mean load of the tick, the balance temperature that it commands, and the
// transition towards it. Four nodes an invocation. Variants (src/gpu/variant.rs) leave out what a scene does not have.

#include "types.glsl"
#include "balance.glsl"
#ifndef SHAPED
#include "transition.glsl"
#endif
#ifdef PLANET_IR
#include "planet.glsl"
#endif
#ifdef ALBEDO
#include "albedo.glsl"
#endif

layout(local_size_x = 64) in;

layout(set = 0, binding = 0) uniform TickBlock { Tick tick; };
layout(set = 0, binding = 3) readonly buffer MaterialBlock { Material materials[]; };
layout(set = 0, binding = 4) readonly buffer GroupMaterialBlock { uint group_material[]; };
layout(set = 0, binding = 11) buffer TemperatureBlock { vec4 temperature[]; };

#ifdef SUN
layout(set = 0, binding = 1) uniform SunBlock { vec4 sun_samples[8]; };
#endif
#ifdef ALBEDO
layout(set = 0, binding = 2) readonly buffer AlbedoBlock { float albedo_values[]; };
#endif
#if defined(SUN) || defined(PLANET_IR)
#define LOADED
layout(set = 0, binding = 5) readonly buffer NormalXBlock { vec4 normal_x[]; };
layout(set = 0, binding = 6) readonly buffer NormalYBlock { vec4 normal_y[]; };
layout(set = 0, binding = 7) readonly buffer NormalZBlock { vec4 normal_z[]; };
#endif
#ifdef SHADOW
layout(set = 0, binding = 13) readonly buffer VisibilityBlock { vec4 visibility[]; };
#endif
#ifdef TRANSITION
layout(set = 0, binding = 8) buffer TargetBlock { vec4 target[]; };
layout(set = 0, binding = 9) buffer SpanBlock { vec4 span[]; };
layout(set = 0, binding = 10) buffer ElapsedBlock { ivec4 elapsed[]; };
#endif
#ifdef PIECES
layout(set = 0, binding = 12) readonly buffer ShapeBlock { vec4 shapes[]; };
#endif
// After the buffers, since these functions may read one.
#ifdef SHAPED
#include "shape.glsl"
#include "shaped_transition.glsl"
#endif

#ifdef SUN
vec4 sun_sample_flux(uint i, vec4 nx, vec4 ny, vec4 nz) {
    vec4 s = sun_samples[i];
    return s.w * max(vec4(0.0), nx * s.x + ny * s.y + nz * s.z);
}

// Incident sunlight, mean over the tick [W/m2]; unused samples have no flux. Written out, for on lavapipe the loop alone
// costs 2.7 ns a node and each sample 0.1 ns, as a uniform at a constant index is read once for all invocations.
vec4 solar_flux(vec4 nx, vec4 ny, vec4 nz) {
    return sun_sample_flux(0u, nx, ny, nz) + sun_sample_flux(1u, nx, ny, nz)
        + sun_sample_flux(2u, nx, ny, nz) + sun_sample_flux(3u, nx, ny, nz)
        + sun_sample_flux(4u, nx, ny, nz) + sun_sample_flux(5u, nx, ny, nz)
        + sun_sample_flux(6u, nx, ny, nz) + sun_sample_flux(7u, nx, ny, nz);
}
#endif

#ifdef ALBEDO
float albedo_table_lookup(float column, float row) {
    float last = tick.albedo_resolution - 1.0;
    uint stride = uint(tick.albedo_resolution) + 1u;
    float left = min(floor(column), last);
    float top = min(floor(row), last);
    float u = column - left;
    float v = row - top;
    uint at = uint(top) * stride + uint(left);
    float upper = albedo_values[at] * (1.0 - u) + albedo_values[at + 1u] * u;
    float lower = albedo_values[at + stride] * (1.0 - u) + albedo_values[at + stride + 1u] * u;
    return upper * (1.0 - v) + lower * v;
}

// Incident sunlight that the planet reflects [W/m2].
vec4 albedo_flux(vec4 nx, vec4 ny, vec4 nz) {
    AlbedoPosition at = albedo_position(tick, nx, ny, nz);
    return tick.albedo_flux * at.scale * vec4(
        albedo_table_lookup(at.column.x, at.row.x),
        albedo_table_lookup(at.column.y, at.row.y),
        albedo_table_lookup(at.column.z, at.row.z),
        albedo_table_lookup(at.column.w, at.row.w)
    );
}
#endif

#ifdef LOADED
// Heat that one face takes in [W/m2]; `seen` is the share of the Sun that it sees.
vec4 absorbed_flux(float absorptivity, float emissivity, vec4 nx, vec4 ny, vec4 nz, vec4 seen) {
    vec4 absorbed = vec4(0.0);
#ifdef SUN
#ifdef SHADOW
    absorbed += absorptivity * seen * solar_flux(nx, ny, nz);
#else
    absorbed += absorptivity * solar_flux(nx, ny, nz);
#endif
#endif
#ifdef ALBEDO
    absorbed += absorptivity * albedo_flux(nx, ny, nz);
#endif
#ifdef PLANET_IR
    absorbed += emissivity * planet_ir_flux(tick, nx, ny, nz);
#endif
    return absorbed;
}
#endif

void main() {
    // Ranges hold whole workgroups, and the buffers are bound from the start of the range.
    uint group = gl_GlobalInvocationID.x;
    Material material = materials[group_material[group]];

#ifdef COMMAND
    vec4 absorbed = vec4(0.0);
    float emissivity = material.emissivity;
#ifdef LOADED
    vec4 nx = normal_x[group];
    vec4 ny = normal_y[group];
    vec4 nz = normal_z[group];
#ifdef SHADOW
    vec4 seen = visibility[group];
#else
    vec4 seen = vec4(1.0);
#endif
    absorbed = absorbed_flux(material.absorptivity, material.emissivity, nx, ny, nz, seen);
#ifdef BOTH_SIDES
    absorbed += absorbed_flux(material.back_absorptivity, material.back_emissivity, -nx, -ny, -nz, seen);
    emissivity += material.back_emissivity;
#endif
#endif
#ifdef ABSORB
    // The flux for the thermal network, which the host collects before it writes the temperatures.
    vec4 commanded = absorbed;
#else
    vec4 commanded = balance_temperature(absorbed, emissivity, tick.background_temperature_4);
#endif
#endif

#ifdef SHAPED
    vec4 old_target = target[group];
    vec4 old_span = span[group];
    ivec4 old_elapsed = elapsed[group];
#ifndef COMMAND
    vec4 commanded = old_target;
#endif
    float step = tick.step;
    ShapedNode x = shaped_step(old_target.x, old_span.x, old_elapsed.x, commanded.x, step, material);
    ShapedNode y = shaped_step(old_target.y, old_span.y, old_elapsed.y, commanded.y, step, material);
    ShapedNode z = shaped_step(old_target.z, old_span.z, old_elapsed.z, commanded.z, step, material);
    ShapedNode w = shaped_step(old_target.w, old_span.w, old_elapsed.w, commanded.w, step, material);
#ifdef COMMAND
    target[group] = commanded;
    span[group] = vec4(x.span, y.span, z.span, w.span);
#endif
    elapsed[group] = ivec4(x.elapsed, y.elapsed, z.elapsed, w.elapsed);
    temperature[group] = vec4(x.temperature, y.temperature, z.temperature, w.temperature);
#else
#ifdef TRANSITION
    TransitionState state = TransitionState(target[group], span[group], elapsed[group]);
#ifdef MERGE
    state = retarget_merge(state, commanded, material);
#endif
#ifdef RESTART
    state = retarget_restart(state, commanded, material);
#endif
    state = advance(state, tick.step, material);
#ifdef COMMAND
    target[group] = state.target;
    span[group] = state.span;
#endif
    elapsed[group] = state.elapsed;
    temperature[group] = transition_temperature(state, material);
#else
    temperature[group] = commanded;
#endif
#endif
}
