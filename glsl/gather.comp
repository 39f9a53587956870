#version 450
// Adds a sample of every pixel to an image that is the mean over its samples. With FIRST the image begins with it. The first sample is that of the centre, and
// the others follow by their distance from it: a pixel shows the temperature, depth, part and material of the first one with a surface. A workgroup makes one
// row. Twin: `rasterise` in src/raster.rs.

#include "types.glsl"

layout(local_size_x = 64) in;

// Share of a sample in a pixel.
layout(push_constant) uniform ShareBlock { float share; };
layout(set = 0, binding = 0) uniform SamplingBlock { Sampling sampling; };
// Radiance, temperature, depth and 1, and part and material. Buffers are words: a processor reads each word by itself, and most are not needed.
layout(set = 0, binding = 1) readonly buffer DrawnRadianceBlock { float drawn_radiance[]; };
layout(set = 0, binding = 2) readonly buffer DrawnIdentityBlock { uint drawn_identity[]; };
// Radiance, temperature, depth and coverage, and part and material.
layout(set = 0, binding = 3) buffer ImageRadianceBlock { float image_radiance[]; };
layout(set = 0, binding = 4) buffer ImageIdentityBlock { uint image_identity[]; };

// Shows the sample in its pixel.
void show(uint pixel, uint part) {
    image_radiance[4u * pixel + 1u] = drawn_radiance[4u * pixel + 1u];
    image_radiance[4u * pixel + 2u] = drawn_radiance[4u * pixel + 2u];
    image_identity[2u * pixel] = part;
    image_identity[2u * pixel + 1u] = drawn_identity[2u * pixel + 1u];
}

void main() {
    uint row = gl_WorkGroupID.x;
    for (uint column = gl_LocalInvocationID.x; column < sampling.width; column += 64u) {
        uint pixel = row * sampling.width + column;
        uint part = drawn_identity[2u * pixel];
        float radiance = share * drawn_radiance[4u * pixel];
        float covered = part > 0u ? share : 0.0;
#ifdef FIRST
        image_radiance[4u * pixel] = radiance;
        image_radiance[4u * pixel + 3u] = covered;
        show(pixel, part);
#else
        // Most pixels show dark space: nothing is added there.
        if (covered > 0.0 || radiance != 0.0) {
            image_radiance[4u * pixel] += radiance;
            float before = image_radiance[4u * pixel + 3u];
            if (before == 0.0) {
                show(pixel, part);
            }
            if (covered > 0.0) {
                image_radiance[4u * pixel + 3u] = before + covered;
            }
        }
#endif
    }
}
