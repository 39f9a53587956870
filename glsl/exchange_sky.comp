#version 450
// The shares of the planet's infrared and albedo that patches see, one patch an invocation. Twin: src/exchange/sky.rs.

#include "types.glsl"
#include "exchange_sky.glsl"

layout(local_size_x = 64) in;

layout(push_constant) uniform PassBlock { ExchangePass pass; };
layout(set = 0, binding = 0) uniform StepBlock { Step steps[1]; };
// Directions of four bundles, and the open ones of their 12 parts, in slot 0, then in slot 1. What is missing in the last four of a patch does not count.
layout(set = 0, binding = 1) readonly buffer ExchangeSkyBlock { uvec4 sky[]; };
layout(set = 0, binding = 2) buffer ExchangeSeenBlock { vec2 seen[]; };
layout(set = 0, binding = 3) readonly buffer ExchangePatchesBlock { ExchangePatch patches[]; };
// Rows of the poses of the body and of the joints.
layout(set = 0, binding = 4) readonly buffer ExchangePosesBlock { vec4 poses[]; };

// A vector of the body in the frame of a joint.
vec3 in_joint(uint pose, vec3 v) {
    return v.x * poses[pose].xyz + v.y * poses[pose + 1u].xyz + v.z * poses[pose + 2u].xyz;
}

// A bundle to the planet, its open share, and the same weighted with the sunlight on the ground.
vec4 ray_part(uint word, vec3 nadir, vec3 sun, float ratio) {
    float light = light_on_ground(ray_direction(word), nadir, sun, ratio);
    float open = float(word >> 28u) * (1.0 / 12.0);
    return light < 0.0 ? vec4(0.0) : vec4(1.0, open, light, open * light);
}

// Just above a half, so that halves are rounded alike whatever the rounding of the share.
const float HALF = 0.5001;

// Four bundles of a patch between both findings, which have the same directions. Twin: `mean_sky` of src/exchange/sky.rs.
uvec4 bundles(uint place, uint behind) {
    if (pass.share == 0.0) {
        return sky[pass.slot * behind + place];
    }
    uvec4 second = sky[(1u - pass.slot) * behind + place];
    if (pass.share == 1.0) {
        return second;
    }
    uvec4 first = sky[pass.slot * behind + place];
    vec4 parts = vec4(first >> uvec4(28u));
    uvec4 open = uvec4(floor(parts + pass.share * (vec4(second >> uvec4(28u)) - parts) + HALF));
    return (open << uvec4(28u)) | (first & uvec4(0x0fffffffu));
}

void main() {
    uint own = pass.first + gl_GlobalInvocationID.x;
    if (own >= pass.end) {
        return;
    }
    uint pose = 3u * patches[own].joint;
    vec3 nadir = in_joint(pose, steps[0].nadir.xyz);
    vec3 sun = in_joint(pose, steps[0].sunward.xyz) * steps[0].sun_sine - nadir * steps[0].sun_cosine;
    float ratio = 1.0 / steps[0].nadir.w;
    // Bundles to the planet, their open shares, and the same weighted with the sunlight on the ground.
    vec4 sums = vec4(0.0);
    float free = 0.0;
    uint fours = (pass.rays + 3u) / 4u;
    uint first = own * fours;
    for (uint k = 0u; k < fours; k++) {
        uvec4 words = bundles(first + k, fours * pass.patches);
        uint left = pass.rays - 4u * k;
        uvec4 open = words >> uvec4(28u);
        free += float(open.x + open.y + open.z + open.w);
        sums += ray_part(words.x, nadir, sun, ratio);
        sums += left > 1u ? ray_part(words.y, nadir, sun, ratio) : vec4(0.0);
        sums += left > 2u ? ray_part(words.z, nadir, sun, ratio) : vec4(0.0);
        sums += left > 3u ? ray_part(words.w, nadir, sun, ratio) : vec4(0.0);
    }
    free /= 12.0 * float(pass.rays);
    seen[own] = vec2(sums.x > 0.0 ? sums.y / sums.x : free, sums.z > 0.0 ? sums.w / sums.z : free);
}
