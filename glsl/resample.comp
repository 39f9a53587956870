#version 450
// Makes an image from the texels of a finer one: with supersampling, the mean of a block of texels; with LENS, through the distortion of a lens.
// A workgroup makes one row. Twin: `rasterise` in src/raster.rs, which casts the ray of each sample.

#include "types.glsl"

layout(local_size_x = 64) in;

layout(set = 0, binding = 0) uniform SamplingBlock { Sampling sampling; };
// Radiance and coverage.
layout(set = 0, binding = 1) readonly buffer SourceRadianceBlock { vec2 source_radiance[]; };
// Part, material, and bits of temperature and depth.
layout(set = 0, binding = 2) readonly buffer SourceSurfaceBlock { uvec4 source_surface[]; };
layout(set = 0, binding = 3) buffer ImageRadianceBlock { vec4 image_radiance[]; };
layout(set = 0, binding = 4) buffer ImageIdentityBlock { uvec2 image_identity[]; };
#ifdef LENS
// Places in the source of the corners of the pixels [texels].
layout(set = 0, binding = 5) readonly buffer LensMapBlock { vec2 lens_map[]; };
#endif

// Index of the texel at a place in a pixel, from its upper left corner.
uint texel_at(uint column, uint row, vec2 place) {
#ifdef LENS
    uint upper = row * (sampling.width + 1u) + column;
    uint lower = upper + sampling.width + 1u;
    vec2 above = mix(lens_map[upper], lens_map[upper + 1u], place.x);
    vec2 below = mix(lens_map[lower], lens_map[lower + 1u], place.x);
    vec2 there = mix(above, below, place.y);
#else
    vec2 there = (vec2(float(column), float(row)) + place) * vec2(float(sampling.columns), float(sampling.rows));
#endif
    // The source has a border of a texel, so that only rounding leaves it.
    uint x = min(uint(max(there.x, 0.0)), sampling.source_width - 1u);
    uint y = min(uint(max(there.y, 0.0)), sampling.source_height - 1u);
    return y * sampling.source_width + x;
}

void main() {
    uint row = gl_WorkGroupID.x;
    vec2 lookups = vec2(float(sampling.columns), float(sampling.rows));
    // The lookup at the centre, or right below it where their number is even.
    vec2 middle = (floor(0.5 * lookups) + vec2(0.5)) / lookups;
    for (uint column = gl_LocalInvocationID.x; column < sampling.width; column += 64u) {
        vec2 sum = vec2(0.0);
        for (uint j = 0u; j < sampling.rows; j++) {
            for (uint i = 0u; i < sampling.columns; i++) {
                sum += source_radiance[texel_at(column, row, (vec2(float(i), float(j)) + vec2(0.5)) / lookups)];
            }
        }
        vec2 mean = sum / (lookups.x * lookups.y);
        uvec4 surface = source_surface[texel_at(column, row, middle)];
        uint pixel = row * sampling.width + column;
        image_radiance[pixel] = vec4(mean.x, uintBitsToFloat(surface.z), uintBitsToFloat(surface.w), mean.y);
        image_identity[pixel] = surface.xy;
    }
}
