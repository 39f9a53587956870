#version 450
// Infrared of the planet and sunlight that patches reflect at first, while they are held and when they were found. One patch an invocation. Twin: `Exchange::light_ahead` of src/exchange/step.rs.
// Variants: SUN: sunlight. ALBEDO: of the planet too. PLANET_IR: infrared of the planet. LIT: nodes have lit area vectors. BY_RAYS: from rays.
// MIRRORS: patches mirror a share of the Sun's light.

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
layout(set = 0, binding = 1) uniform SunSamplesBlock { vec4 sun_samples[8]; };
#endif
#ifdef ALBEDO
layout(set = 0, binding = 2) readonly buffer AlbedoValuesBlock { float albedo_values[]; };
#endif
layout(set = 0, binding = 3) readonly buffer ExchangePatchesBlock { ExchangePatch patches[]; };
#ifdef LIT
// Nodes of the patches, each with the bits of its share of the patch.
layout(set = 0, binding = 4) readonly buffer ExchangeMembersBlock { uvec2 members[]; };
layout(set = 0, binding = 5) readonly buffer LitXBlock { float lit_x[]; };
layout(set = 0, binding = 10) readonly buffer LitYBlock { float lit_y[]; };
layout(set = 0, binding = 11) readonly buffer LitZBlock { float lit_z[]; };
layout(set = 0, binding = 12) readonly buffer LitFrontBlock { float lit_front[]; };
#endif
#ifdef PLANET_IR
#define SEEN
#endif
#ifdef ALBEDO
#define SEEN
#endif
#ifdef SEEN
layout(set = 0, binding = 6) readonly buffer ExchangeSeenBlock { vec2 seen[]; };
#endif
// Rows of the poses of the body and of the joints.
layout(set = 0, binding = 7) readonly buffer ExchangePosesBlock { vec4 poses[]; };
layout(set = 0, binding = 8) buffer ExchangeReflectedBlock { vec4 reflected[]; };
#ifdef SUN
#ifndef BY_RAYS
// Rows of the patches in slot 0, then in slot 1.
layout(set = 0, binding = 13) readonly buffer ExchangeRowsBlock { ExchangeRow rows[]; };
#endif
#endif
#ifdef MIRRORS
layout(set = 0, binding = 9) buffer ExchangeMirroredBlock { float mirrored[]; };
#endif

#ifdef SUN
float sun_sample_flux(vec4 sample_, vec3 normal) {
    return sample_.w * max(0.0, dot(sample_.xyz, normal));
}

// Sunlight on a normal or on a lit area vector [W/m2].
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

// A vector of a joint's frame in the body frame. `pose` is the first row of the joint.
vec3 turned(uint pose, vec3 vector) {
    return vec3(dot(poses[pose].xyz, vector), dot(poses[pose + 1u].xyz, vector), dot(poses[pose + 2u].xyz, vector));
}

void main() {
    uint own = pass.first + gl_GlobalInvocationID.x;
    if (own >= pass.end) {
        return;
    }
    ExchangePatch here = patches[own];
    uint pose = 3u * here.joint;
    vec3 normal = turned(pose, here.normal);
#ifdef SEEN
    vec2 comes = seen[own];
#endif
    float infrared = 0.0;
    float sunlight = 0.0;
#ifdef PLANET_IR
    vec4 open = planet_ir_flux(steps[0], vec4(normal.x), vec4(normal.y), vec4(normal.z));
    infrared = (1.0 - here.emissivity) * comes.x * open.x;
#endif
#ifdef SUN
#ifdef LIT
    vec3 lit = vec3(0.0);
    for (uint k = here.first_node; k < here.end_node; k++) {
        uvec2 member = members[k];
        float front = lit_front[member.x];
        float on_face = here.back == 1u ? 1.0 - front : front;
        lit += uintBitsToFloat(member.y) * on_face * vec3(lit_x[member.x], lit_y[member.x], lit_z[member.x]);
    }
    sunlight += solar_flux(turned(pose, lit));
#else
    sunlight += solar_flux(normal);
#endif
#ifndef BY_RAYS
    float exposed = pass.share < 1.0 ? (1.0 - pass.share) * rows[pass.slot * pass.patches + own].exposed : 0.0;
    exposed += pass.share > 0.0 ? pass.share * rows[(1u - pass.slot) * pass.patches + own].exposed : 0.0;
    sunlight *= exposed;
#endif
#endif
#ifdef MIRRORS
    mirrored[own] = here.specular * ((1.0 - here.absorptivity) * sunlight);
    sunlight *= 1.0 - here.specular;
#endif
#ifdef ALBEDO
    sunlight += comes.y * albedo_flux(normal);
#endif
    vec2 found = vec2(infrared, (1.0 - here.absorptivity) * sunlight);
    // In the middle of the time for which the light is held.
    vec2 ahead = found + pass.lead * (found - reflected[own].zw);
    reflected[own] = vec4(max(ahead, vec2(0.0)), found);
}
