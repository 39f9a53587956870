#version 450
// Makes an image from finer ones. With LENS it is drawn through the distortion of a lens. With SEVERAL the radiance is the mean over several samples of a
// pixel. A workgroup makes one row. Twin: `rasterise` in src/raster.rs, which casts the ray of each sample.

#include "types.glsl"

layout(local_size_x = 64) in;

layout(set = 0, binding = 0) uniform SamplingBlock { Sampling sampling; };
// Radiance, temperature, depth and 1, and part and material. With LENS they are those of a finer image.
layout(set = 0, binding = 1) readonly buffer DrawnRadianceBlock { vec4 drawn_radiance[]; };
layout(set = 0, binding = 2) readonly buffer DrawnIdentityBlock { uvec2 drawn_identity[]; };
layout(set = 0, binding = 3) buffer ImageRadianceBlock { vec4 image_radiance[]; };
layout(set = 0, binding = 4) buffer ImageIdentityBlock { uvec2 image_identity[]; };
#ifdef LENS
// Places of the corners of the pixels in the finer image [texels].
layout(set = 0, binding = 5) readonly buffer LensMapBlock { vec2 lens_map[]; };
#endif
#ifdef FINE
// Radiance of the four texels of a row of texels in a pixel, for a point spread.
layout(set = 0, binding = 7) buffer SensorFineBlock { vec4 fine[]; };
#endif
#ifdef SEVERAL
// Mean radiance and coverage of the texels of the finer image.
layout(set = 0, binding = 6) readonly buffer MeanBlock { vec2 mean_radiance[]; };
#endif

#ifdef LENS
// Where a place in a pixel, from its upper left corner, lies in the finer image [texels].
vec2 source_of(uint column, uint row, vec2 place) {
    uint upper = row * (sampling.width + 1u) + column;
    uint lower = upper + sampling.width + 1u;
    vec2 above = mix(lens_map[upper], lens_map[upper + 1u], place.x);
    vec2 below = mix(lens_map[lower], lens_map[lower + 1u], place.x);
    return mix(above, below, place.y);
}

// Index of the texel at a place. The finer image has a border of a texel, so that only rounding leaves it.
uint texel_at(vec2 there) {
    uint x = min(uint(max(there.x, 0.0)), sampling.source_width - 1u);
    uint y = min(uint(max(there.y, 0.0)), sampling.source_height - 1u);
    return y * sampling.source_width + x;
}
#endif

#ifdef SEVERAL
// Mean radiance and coverage at a place in a pixel.
vec2 mean_at(uint column, uint row, vec2 place) {
#ifdef LENS
    // Between the centres of four texels, so that an edge is where its mean is.
    vec2 there = source_of(column, row, place) - vec2(0.5);
    vec2 first = floor(there);
    vec2 share = there - first;
    vec2 upper = mix(mean_radiance[texel_at(first)], mean_radiance[texel_at(first + vec2(1.0, 0.0))], share.x);
    vec2 lower = mix(mean_radiance[texel_at(first + vec2(0.0, 1.0))], mean_radiance[texel_at(first + vec2(1.0))], share.x);
    return mix(upper, lower, share.y);
#else
    uint x = column * sampling.columns + uint(place.x * float(sampling.columns));
    uint y = row * sampling.rows + uint(place.y * float(sampling.rows));
    return mean_radiance[y * sampling.source_width + x];
#endif
}
#endif

void main() {
    uint row = gl_WorkGroupID.x;
    for (uint column = gl_LocalInvocationID.x; column < sampling.width; column += 64u) {
        uint pixel = row * sampling.width + column;
#ifdef LENS
        uint drawn = texel_at(source_of(column, row, vec2(0.5)));
#else
        uint drawn = pixel;
#endif
        vec4 radiance = drawn_radiance[drawn];
#ifdef SEVERAL
        vec2 lookups = vec2(float(sampling.columns), float(sampling.rows));
        vec2 sum = vec2(0.0);
        for (uint j = 0u; j < sampling.rows; j++) {
#ifdef FINE
            vec2 a = mean_at(column, row, (vec2(0.0, float(j)) + vec2(0.5)) / lookups);
            vec2 b = mean_at(column, row, (vec2(1.0, float(j)) + vec2(0.5)) / lookups);
            vec2 c = mean_at(column, row, (vec2(2.0, float(j)) + vec2(0.5)) / lookups);
            vec2 d = mean_at(column, row, (vec2(3.0, float(j)) + vec2(0.5)) / lookups);
            fine[(row * 4u + j) * sampling.width + column] = vec4(a.x, b.x, c.x, d.x);
            sum += a + b + c + d;
#else
            for (uint i = 0u; i < sampling.columns; i++) {
                sum += mean_at(column, row, (vec2(float(i), float(j)) + vec2(0.5)) / lookups);
            }
#endif
        }
        vec2 mean = sum / (lookups.x * lookups.y);
        radiance = vec4(mean.x, radiance.y, radiance.z, mean.y);
#endif
        image_radiance[pixel] = radiance;
        image_identity[pixel] = drawn_identity[drawn];
    }
}
