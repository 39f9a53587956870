#version 450
// Adds a sub-frame to an exposure, which is the mean over its sub-frames. With FIRST the mean begins with it. With LAST the mean takes the place of the image.
// A pixel shows the temperature, depth, part and material of the first sub-frame that has a surface. With TEXELS it is the mean of the texels in the pixels.
// A workgroup makes one row. Twin: `exposed` in src/simulation/reference_engine/drawing.rs.

#include "types.glsl"

layout(local_size_x = 64) in;

// Share of a sub-frame in the exposure.
layout(push_constant) uniform ShareBlock { float share; };
layout(set = 0, binding = 0) uniform SamplingBlock { Sampling sampling; };
#ifdef TEXELS
layout(set = 0, binding = 1) buffer SensorFineBlock { vec4 fine[]; };
layout(set = 0, binding = 2) buffer ExposedFineBlock { vec4 exposed_fine[]; };

void main() {
    uint row = 4u * sampling.width * gl_WorkGroupID.x;
    for (uint place = gl_LocalInvocationID.x; place < 4u * sampling.width; place += 64u) {
        vec4 sum = share * fine[row + place];
#ifndef FIRST
        sum += exposed_fine[row + place];
#endif
#ifdef LAST
        fine[row + place] = sum;
#else
        exposed_fine[row + place] = sum;
#endif
    }
}
#else
// Radiance, temperature, depth and a fourth value that is coverage or reflected radiance, and part and material.
layout(set = 0, binding = 1) buffer ImageRadianceBlock { vec4 image_radiance[]; };
layout(set = 0, binding = 2) buffer ImageIdentityBlock { uvec2 image_identity[]; };
layout(set = 0, binding = 3) buffer ExposedRadianceBlock { vec4 exposed_radiance[]; };
layout(set = 0, binding = 4) buffer ExposedIdentityBlock { uvec2 exposed_identity[]; };

void main() {
    uint row = gl_WorkGroupID.x;
    for (uint column = gl_LocalInvocationID.x; column < sampling.width; column += 64u) {
        uint pixel = row * sampling.width + column;
        vec4 own = image_radiance[pixel];
        uvec2 identity = image_identity[pixel];
        vec4 sum = vec4(share * own.x, own.yz, share * own.w);
#ifndef FIRST
        vec4 before = exposed_radiance[pixel];
        uvec2 shown = exposed_identity[pixel];
        bool has = shown.x > 0u;
        sum = vec4(before.x + sum.x, has ? before.yz : own.yz, before.w + sum.w);
        identity = has ? shown : identity;
#endif
#ifdef LAST
        image_radiance[pixel] = sum;
        image_identity[pixel] = identity;
#else
        exposed_radiance[pixel] = sum;
        exposed_identity[pixel] = identity;
#endif
    }
}
#endif
