#version 450
// Thermal step of a range of nodes: load, balance temperature and response. Four nodes an invocation. Variants
// (src/gpu/effects/thermal.rs): INSTANT or none: balance temperature. MERGE, RESTART: transition. ADVANCE: transition with an
// unchanged target and no load. RADIATIVE: energy balance of the node by itself. ABSORB: flux absorbed by a thermal
// network. FUSED: many steps, each with its own load. It writes the temperatures of the last step.

#if defined(MERGE) || defined(RESTART) || defined(ADVANCE)
#define TRANSITION
#endif
#ifndef ADVANCE
#define COMMAND
#endif
#if !defined(TRANSITION) && !defined(RADIATIVE)
#define FOLLOWS
#endif

#include "types.glsl"
#include "balance.glsl"
#ifdef RADIATIVE
#include "radiative.glsl"
#else
#ifndef SHAPED
#include "transition.glsl"
#endif
#endif
#ifdef PLANET_IR
#include "planet.glsl"
#endif
#ifdef ALBEDO
#include "albedo.glsl"
#endif

layout(local_size_x = 64) in;

// Most steps of one dispatch: FUSED_STEPS of src/gpu/layout.rs.
#ifdef FUSED
const uint STEPS = 32u;
#define STEP_BLOCK FusedStepsBlock
#define SUN_BLOCK FusedSunSamplesBlock
#define ALBEDO_BLOCK FusedAlbedoValuesBlock
#else
const uint STEPS = 1u;
#define STEP_BLOCK StepBlock
#define SUN_BLOCK SunSamplesBlock
#define ALBEDO_BLOCK AlbedoValuesBlock
#endif

layout(set = 0, binding = 0) uniform STEP_BLOCK { Step steps[STEPS]; };
layout(set = 0, binding = 3) readonly buffer MaterialsBlock { Material materials[]; };
layout(set = 0, binding = 4) readonly buffer GroupMaterialBlock { uint group_material[]; };
layout(set = 0, binding = 11) buffer TemperatureBlock { vec4 temperature[]; };

#ifdef SUN
layout(set = 0, binding = 1) uniform SUN_BLOCK { vec4 sun_samples[8u * STEPS]; };
#endif
#ifdef ALBEDO
layout(set = 0, binding = 2) readonly buffer ALBEDO_BLOCK { float albedo_values[]; };
#endif
#if defined(SUN) || defined(PLANET_IR)
#define LOADED
layout(set = 0, binding = 5) readonly buffer NormalXBlock { vec4 normal_x[]; };
layout(set = 0, binding = 6) readonly buffer NormalYBlock { vec4 normal_y[]; };
layout(set = 0, binding = 7) readonly buffer NormalZBlock { vec4 normal_z[]; };
#endif
#ifdef LIT
// Lit area vectors of the nodes, and the share of the light on their fronts.
layout(set = 0, binding = 13) readonly buffer LitXBlock { vec4 lit_x[]; };
layout(set = 0, binding = 17) readonly buffer LitYBlock { vec4 lit_y[]; };
layout(set = 0, binding = 18) readonly buffer LitZBlock { vec4 lit_z[]; };
#ifdef BOTH_SIDES
layout(set = 0, binding = 19) readonly buffer LitFrontBlock { vec4 lit_front[]; };
#endif
#endif
#ifdef EXCHANGE
#ifndef BY_RAYS
// Rays tell what lies inside other parts. Without them its share gets no sunlight.
#define EXPOSED
#endif
#if defined(PLANET_IR) || defined(ALBEDO)
#define HIDDEN
#endif
// Flux from other surfaces that the fronts of the nodes of a group absorb [W/m2], then their backs.
layout(set = 0, binding = 20) readonly buffer ExchangeOnNodesBlock { vec4 exchange_on_nodes[]; };
#if defined(HIDDEN) || defined(EXPOSED)
#define PATCHED
// Patches of these faces.
layout(set = 0, binding = 14) readonly buffer ExchangeNodesBlock { uvec4 exchange_nodes[]; };
#endif
#ifdef EXPOSED
// Flux from other surfaces that every patch absorbs [W/m2], and the share of the patch that sunlight can reach.
layout(set = 0, binding = 15) readonly buffer ExchangeReceivedBlock { vec2 exchange_received[]; };
#endif
#ifdef HIDDEN
// Shares of the planet's infrared and albedo that every patch sees.
layout(set = 0, binding = 16) readonly buffer ExchangeSeenBlock { vec2 exchange_seen[]; };
#endif
#endif
#ifdef TRANSITION
layout(set = 0, binding = 8) buffer TargetBlock { vec4 target[]; };
layout(set = 0, binding = 9) buffer SpanBlock { vec4 span[]; };
layout(set = 0, binding = 10) buffer ElapsedBlock { ivec4 elapsed[]; };
#endif
#ifdef RADIATIVE
// What the temperatures leave out [K].
layout(set = 0, binding = 9) buffer SpanBlock { vec4 span[]; };
#ifdef OVER
// Temperature of the structures [K], and their words.
layout(set = 0, binding = 8) buffer TargetBlock { vec4 target[]; };
layout(set = 0, binding = 10) buffer ElapsedBlock { ivec4 elapsed[]; };
#endif
#endif
#ifdef SHAPED
layout(set = 0, binding = 12) readonly buffer ShapesBlock { vec2 shapes[]; };
// The include must follow the buffer that its functions read.
#include "shaped_transition.glsl"
#endif

#ifdef SUN
vec4 sun_sample_flux(uint i, vec4 nx, vec4 ny, vec4 nz) {
    vec4 s = sun_samples[i];
    return s.w * max(vec4(0.0), nx * s.x + ny * s.y + nz * s.z);
}

// Sunlight on a normal or on a lit area vector, mean over the step [W/m2]. Unused samples have no flux. The loop is unrolled: on lavapipe a loop
// costs 2.7 ns a node, but an unrolled sample 0.1 ns, because a uniform at a constant index is read once for all
// invocations.
vec4 solar_flux(uint number, vec4 nx, vec4 ny, vec4 nz) {
    uint i = 8u * number;
    return sun_sample_flux(i, nx, ny, nz) + sun_sample_flux(i + 1u, nx, ny, nz)
        + sun_sample_flux(i + 2u, nx, ny, nz) + sun_sample_flux(i + 3u, nx, ny, nz)
        + sun_sample_flux(i + 4u, nx, ny, nz) + sun_sample_flux(i + 5u, nx, ny, nz)
        + sun_sample_flux(i + 6u, nx, ny, nz) + sun_sample_flux(i + 7u, nx, ny, nz);
}
#endif

#ifdef ALBEDO
float albedo_table_lookup(uint number, float column, float row) {
    float last = steps[number].albedo_resolution - 1.0;
    uint stride = uint(steps[number].albedo_resolution) + 1u;
    float left = min(floor(column), last);
    float top = min(floor(row), last);
    float u = column - left;
    float v = row - top;
    uint at = (number * stride + uint(top)) * stride + uint(left);
    float upper = albedo_values[at] * (1.0 - u) + albedo_values[at + 1u] * u;
    float lower = albedo_values[at + stride] * (1.0 - u) + albedo_values[at + stride + 1u] * u;
    return upper * (1.0 - v) + lower * v;
}

// Incident sunlight reflected by the planet [W/m2].
vec4 albedo_flux(uint number, vec4 nx, vec4 ny, vec4 nz) {
    AlbedoPosition at = albedo_position(steps[number], nx, ny, nz);
    return steps[number].albedo_flux * at.scale * vec4(
        albedo_table_lookup(number, at.column.x, at.row.x),
        albedo_table_lookup(number, at.column.y, at.row.y),
        albedo_table_lookup(number, at.column.z, at.row.z),
        albedo_table_lookup(number, at.column.w, at.row.w)
    );
}
#endif

#ifdef EXPOSED
// Shares of the faces that lie outside other parts.
vec4 exposed_share(uvec4 at) {
    return vec4(exchange_received[at.x].y, exchange_received[at.y].y, exchange_received[at.z].y, exchange_received[at.w].y);
}
#endif

#ifdef LOADED
// Flux absorbed by one face from Sun and planet [W/m2]. `sunlight` falls on the face [W/m2], and `patches` are those of the nodes.
vec4 absorbed_by_face(uint number, float absorptivity, float emissivity, vec4 nx, vec4 ny, vec4 nz, vec4 sunlight, uvec4 patches) {
    vec4 absorbed = vec4(0.0);
#ifdef HIDDEN
    vec2 first = exchange_seen[patches.x];
    vec2 second = exchange_seen[patches.y];
    vec2 third = exchange_seen[patches.z];
    vec2 fourth = exchange_seen[patches.w];
#endif
#ifdef SUN
#ifdef EXPOSED
    sunlight *= exposed_share(patches);
#endif
    absorbed += absorptivity * sunlight;
#endif
#ifdef ALBEDO
    vec4 albedo = albedo_flux(number, nx, ny, nz);
#ifdef EXCHANGE
    albedo *= vec4(first.y, second.y, third.y, fourth.y);
#endif
    absorbed += absorptivity * albedo;
#endif
#ifdef PLANET_IR
    vec4 infrared = planet_ir_flux(steps[number], nx, ny, nz);
#ifdef EXCHANGE
    infrared *= vec4(first.x, second.x, third.x, fourth.x);
#endif
    absorbed += emissivity * infrared;
#endif
    return absorbed;
}
#endif

#ifdef COMMAND
#if defined(ABSORB) || defined(RADIATIVE)
#define FLUX
#endif

// Balance temperature of a step [K]. FLUX: absorbed flux [W/m2].
vec4 commanded_by(uint number, Material material, uint group, uvec4 fronts, uvec4 backs) {
    vec4 absorbed = vec4(0.0);
    float emissivity = material.emissivity;
#ifdef LOADED
    vec4 nx = normal_x[group];
    vec4 ny = normal_y[group];
    vec4 nz = normal_z[group];
    vec4 on_front = vec4(0.0);
    vec4 on_back = vec4(0.0);
#ifdef LIT
    on_front = solar_flux(number, lit_x[group], lit_y[group], lit_z[group]);
#ifdef BOTH_SIDES
    on_back = (1.0 - lit_front[group]) * on_front;
    on_front *= lit_front[group];
#endif
#else
#ifdef SUN
    on_front = solar_flux(number, nx, ny, nz);
#ifdef BOTH_SIDES
    on_back = solar_flux(number, -nx, -ny, -nz);
#endif
#endif
#endif
    absorbed = absorbed_by_face(number, material.absorptivity, material.emissivity, nx, ny, nz, on_front, fronts);
#ifdef BOTH_SIDES
    absorbed += absorbed_by_face(number, material.back_absorptivity, material.back_emissivity, -nx, -ny, -nz, on_back, backs);
    emissivity += material.back_emissivity;
#endif
#endif
#ifdef EXCHANGE
    absorbed += exchange_on_nodes[2u * group];
#ifdef BOTH_SIDES
    absorbed += exchange_on_nodes[2u * group + 1u];
#endif
#endif
#ifdef FLUX
    // ABSORB: the host reads the flux before it writes the temperatures.
    return absorbed;
#else
    return balance_temperature(absorbed, emissivity, steps[number].background_temperature_4);
#endif
}
#endif

#ifdef RADIATIVE
// One step of a plate: twin `radiative_step` of src/thermal/radiative.rs.
Carried plate_step(Carried outside, Material material, float length, vec4 power) {
    vec4 here = outside.value;
    vec4 squared = here * here;
    vec4 emission = vec4(length * material.share * material.emission);
    return carried(outside, outside_change(here, power - emission * squared * squared, power, emission));
}
#endif

void main() {
    // Ranges have whole workgroups, and the buffers are bound from the start of the range.
    uint group = gl_GlobalInvocationID.x;
    Material material = materials[group_material[group]];

    uvec4 fronts = uvec4(0u);
    uvec4 backs = uvec4(0u);
#ifdef PATCHED
    fronts = exchange_nodes[2u * group];
    backs = exchange_nodes[2u * group + 1u];
#endif

#ifdef TRANSITION
    vec4 own_target = target[group];
    vec4 own_span = span[group];
    ivec4 own_elapsed = elapsed[group];
#ifdef SHAPED
    vec4 reached = vec4(0.0);
#endif
#ifdef FUSED
    uint count = uint(steps[0].count);
    for (uint number = 0u; number < count; number++) {
#else
    const uint number = 0u;
    {
#endif
#ifdef COMMAND
        vec4 commanded = commanded_by(number, material, group, fronts, backs);
#else
        vec4 commanded = own_target;
#endif
        float step = steps[number].length;
#ifdef SHAPED
        ShapedBranches both = shaped_branches(material, step);
        ShapedNode x = transition_step(own_target.x, own_span.x, own_elapsed.x, commanded.x, both);
        ShapedNode y = transition_step(own_target.y, own_span.y, own_elapsed.y, commanded.y, both);
        ShapedNode z = transition_step(own_target.z, own_span.z, own_elapsed.z, commanded.z, both);
        ShapedNode w = transition_step(own_target.w, own_span.w, own_elapsed.w, commanded.w, both);
        own_target = vec4(x.target, y.target, z.target, w.target);
        own_span = vec4(x.gap, y.gap, z.gap, w.gap);
        own_elapsed = ivec4(x.elapsed, y.elapsed, z.elapsed, w.elapsed);
        reached = vec4(x.temperature, y.temperature, z.temperature, w.temperature);
#else
        TransitionState state = TransitionState(own_target, own_span, own_elapsed);
#ifdef MERGE
        state = retarget_merge(state, commanded, material);
#endif
#ifdef RESTART
        state = retarget_restart(state, commanded, material);
#endif
        state = advance(state, step, material);
        own_target = state.target;
        own_span = state.span;
        own_elapsed = state.elapsed;
#endif
    }
#ifdef COMMAND
    target[group] = own_target;
#endif
#if defined(COMMAND) || defined(SHAPED)
    span[group] = own_span;
#endif
    elapsed[group] = own_elapsed;
#ifdef SHAPED
    temperature[group] = reached;
#else
    temperature[group] = transition_temperature(TransitionState(own_target, own_span, own_elapsed), material);
#endif
#endif
#ifdef RADIATIVE
    Carried outside = Carried(temperature[group], span[group]);
#ifdef OVER
    Structure structure = structure_of(target[group], elapsed[group]);
#endif
#ifdef FUSED
    uint count = uint(steps[0].count);
    for (uint number = 0u; number < count; number++) {
#else
    const uint number = 0u;
    {
#endif
        vec4 into = commanded_by(number, material, group, fronts, backs)
            + vec4(material.own_emission * steps[number].background_temperature_4);
        float length = steps[number].length;
#ifdef OVER
        length /= material.parts;
        uint parts = uint(material.parts);
        for (uint part = 0u; part < parts; part++) {
            vec4 held = structure.temperature.value + 0.5 * length * structure.trend;
            vec4 held_squared = held * held;
            vec4 power = length * material.share * (into + material.exchange * held_squared * held_squared);
            vec4 here = outside.value;
            vec4 squared = here * here;
            vec4 emission = vec4(length * material.share * material.emission);
            vec4 start = power - emission * squared * squared;
            vec4 change = outside_change(here, start, power, emission);
            // Mean of the outside's T^4 less that of the structure. What the outside did not store it has emitted.
            vec4 hotter = (here - held) * (here + held) * (squared + held_squared) + (start - change) / emission;
            vec4 moved = length * material.structure_share * material.exchange * hotter;
            outside = carried(outside, change);
            structure = Structure(carried(structure.temperature, moved), moved / length);
        }
#else
        outside = plate_step(outside, material, length, length * material.share * into);
#endif
    }
#ifdef OVER
    target[group] = structure.temperature.value;
    elapsed[group] = word_of(structure);
#endif
    span[group] = outside.rest;
    temperature[group] = outside.value;
#endif
#ifdef FOLLOWS
    temperature[group] = commanded_by(0u, material, group, fronts, backs);
#endif
}
