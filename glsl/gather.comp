#version 450
// Adds a sample of every pixel to an image that is the mean over its samples. With FIRST the image begins with it. The first sample is that of the centre, and
// the others follow by their distance from it: a pixel shows the temperature, depth, part and material of the first one with a surface. A workgroup makes one
// row. Twin: `rasterise` in src/raster.rs.

#include "types.glsl"

layout(local_size_x = 64) in;

// Share of a sample in a pixel.
layout(push_constant) uniform ShareBlock { float share; };
layout(set = 0, binding = 0) uniform SamplingBlock { Sampling sampling; };
// Radiance, temperature, depth and 1, and part and material.
layout(set = 0, binding = 1) readonly buffer DrawnRadianceBlock { vec4 drawn_radiance[]; };
layout(set = 0, binding = 2) readonly buffer DrawnIdentityBlock { uvec2 drawn_identity[]; };
// Radiance, temperature, depth and coverage, and part and material.
layout(set = 0, binding = 3) buffer ImageRadianceBlock { vec4 image_radiance[]; };
layout(set = 0, binding = 4) buffer ImageIdentityBlock { uvec2 image_identity[]; };

void main() {
    uint row = gl_WorkGroupID.x;
    for (uint column = gl_LocalInvocationID.x; column < sampling.width; column += 64u) {
        uint pixel = row * sampling.width + column;
        uvec2 identity = drawn_identity[pixel];
        vec4 own = drawn_radiance[pixel];
        float covered = identity.x > 0u ? share : 0.0;
#ifdef FIRST
        image_radiance[pixel] = vec4(share * own.x, own.yz, covered);
        image_identity[pixel] = identity;
#else
        // Most pixels show dark space: nothing is added there.
        if (covered == 0.0 && own.x == 0.0) {
            continue;
        }
        vec4 image = image_radiance[pixel];
        bool has = image.w > 0.0;
        image_radiance[pixel] = vec4(image.x + share * own.x, has ? image.yz : own.yz, image.w + covered);
        if (!has) {
            image_identity[pixel] = identity;
        }
#endif
    }
}
