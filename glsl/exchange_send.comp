#version 450
// Infrared and sunlight that leave patches at first: emission above that of space, and reflection of what comes from Sun and
// planet. One patch an invocation. Twin: `Exchange::sent` of src/exchange/step.rs. Variants: SUN: sunlight. ALBEDO: of the planet too.
// PLANET_IR: infrared of the planet. SHADOW: nodes see a share of the Sun.

#include "types.glsl"
#ifdef PLANET_IR
#include "planet.glsl"
#endif
#ifdef ALBEDO
#include "albedo.glsl"
#endif

layout(local_size_x = 64) in;

layout(push_constant) uniform PassBlock { ExchangePass pass; };
layout(set = 0, binding = 0) uniform StepBlock { Step steps[1]; };
#ifdef SUN
layout(set = 0, binding = 1) uniform SunBlock { vec4 sun_samples[8]; };
#endif
#ifdef ALBEDO
layout(set = 0, binding = 2) readonly buffer AlbedoBlock { float albedo_values[]; };
#endif
layout(set = 0, binding = 3) readonly buffer ExchangePatchBlock { ExchangePatch patches[]; };
// Nodes of the patches, each with the bits of its share of the patch.
layout(set = 0, binding = 4) readonly buffer ExchangeMemberBlock { uvec2 members[]; };
layout(set = 0, binding = 5) readonly buffer TemperatureBlock { float temperature[]; };
#ifdef SHADOW
layout(set = 0, binding = 6) readonly buffer VisibilityBlock { float visibility[]; };
#endif
#ifdef PLANET_IR
#define SEEN
#endif
#ifdef ALBEDO
#define SEEN
#endif
#ifdef SEEN
layout(set = 0, binding = 7) readonly buffer ExchangeSeenBlock { vec2 seen[]; };
#endif
layout(set = 0, binding = 8) buffer ExchangeSentBlock { vec2 sent[]; };

const float STEFAN_BOLTZMANN = 5.670374419e-8;

#ifdef SUN
float sun_sample_flux(vec4 sample_, vec3 normal) {
    return sample_.w * max(0.0, dot(sample_.xyz, normal));
}

// Incident sunlight without shadows [W/m2].
float solar_flux(vec3 normal) {
    return sun_sample_flux(sun_samples[0], normal) + sun_sample_flux(sun_samples[1], normal)
        + sun_sample_flux(sun_samples[2], normal) + sun_sample_flux(sun_samples[3], normal)
        + sun_sample_flux(sun_samples[4], normal) + sun_sample_flux(sun_samples[5], normal)
        + sun_sample_flux(sun_samples[6], normal) + sun_sample_flux(sun_samples[7], normal);
}
#endif

#ifdef ALBEDO
// Incident sunlight that the planet reflects to an open face [W/m2].
float albedo_flux(vec3 normal) {
    AlbedoPosition at = albedo_position(steps[0], vec4(normal.x), vec4(normal.y), vec4(normal.z));
    float last = steps[0].albedo_resolution - 1.0;
    uint stride = uint(steps[0].albedo_resolution) + 1u;
    float left = min(floor(at.column.x), last);
    float top = min(floor(at.row.x), last);
    float u = at.column.x - left;
    float v = at.row.x - top;
    uint place = uint(top) * stride + uint(left);
    float upper = albedo_values[place] * (1.0 - u) + albedo_values[place + 1u] * u;
    float lower = albedo_values[place + stride] * (1.0 - u) + albedo_values[place + stride + 1u] * u;
    return steps[0].albedo_flux * at.scale.x * (upper * (1.0 - v) + lower * v);
}
#endif

void main() {
    uint own = pass.first + gl_GlobalInvocationID.x;
    if (own >= pass.end) {
        return;
    }
    ExchangePatch here = patches[own];
    float fourth = 0.0;
#ifdef SHADOW
    float lit = 0.0;
#endif
#ifndef SHADOW
    float lit = 1.0;
#endif
    for (uint k = here.first_node; k < here.end_node; k++) {
        uvec2 member = members[k];
        float share = uintBitsToFloat(member.y);
        float squared = temperature[member.x] * temperature[member.x];
        fourth += share * (squared * squared);
#ifdef SHADOW
        lit += share * visibility[member.x];
#endif
    }
    vec3 normal = here.normal;
#ifdef SEEN
    vec2 comes = seen[own];
#endif
    float infrared = here.emissivity * STEFAN_BOLTZMANN * (fourth - steps[0].background_temperature_4);
    float sunlight = 0.0;
#ifdef PLANET_IR
    vec4 open = planet_ir_flux(steps[0], vec4(normal.x), vec4(normal.y), vec4(normal.z));
    infrared += (1.0 - here.emissivity) * comes.x * open.x;
#endif
#ifdef SUN
    sunlight += lit * solar_flux(normal);
#endif
#ifdef ALBEDO
    sunlight += comes.y * albedo_flux(normal);
#endif
    sent[own] = vec2(infrared, (1.0 - here.absorptivity) * sunlight);
}
