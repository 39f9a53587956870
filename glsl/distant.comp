#version 450
// Makes the image of a craft that spans few pixels from a crop around it, which is drawn with many texels in a pixel. With SKY the planet and space stand
// behind it. A workgroup makes one row. Twin: src/raster/distant.rs.

#include "types.glsl"

#ifdef SKY
#include "sky.glsl"
layout(set = 0, binding = 12) uniform SurroundingsBlock { Surroundings around; };
#endif

layout(local_size_x = 64) in;

layout(set = 0, binding = 0) uniform DistantBlock { Distant distant; };
// The crop in the upper left corner of an image: radiance, temperature, depth and a fourth value, and part and material.
layout(set = 0, binding = 1) readonly buffer DrawnRadianceBlock { vec4 drawn_radiance[]; };
layout(set = 0, binding = 2) readonly buffer DrawnIdentityBlock { uvec2 drawn_identity[]; };
layout(set = 0, binding = 3) buffer ImageRadianceBlock { vec4 image_radiance[]; };
layout(set = 0, binding = 4) buffer ImageIdentityBlock { uvec2 image_identity[]; };
#ifdef FINE
// Radiance of the four texels of a row of texels in a pixel, for a point spread.
layout(set = 0, binding = 5) buffer SensorFineBlock { vec4 fine[]; };
#endif

// Where a border between pixels lies among the texels of the crop.
float place_of(uint border, float corner, float scale, uint texels) {
    return clamp((float(border) - corner) * scale, 0.0, float(texels));
}

// Share of the side of a texel between two places.
float overlap(uint texel, float low, float high) {
    return max(min(high, float(texel) + 1.0) - max(low, float(texel)), 0.0);
}

// Radiance behind the craft in a pixel.
float behind(vec2 pixel) {
    float sum = 0.0;
#ifdef SKY
    for (float j = 0.5; j < distant.lookups; j += 1.0) {
        for (float i = 0.5; i < distant.lookups; i += 1.0) {
            vec2 place = pixel + vec2(i, j) / distant.lookups;
            sum += sky_radiance(around, normalize(vec3((place - distant.centre) / distant.focal, 1.0)));
        }
    }
    sum /= distant.lookups * distant.lookups;
#endif
    return sum;
}

#ifdef FINE
// Radiance of a part of a pixel: its place in parts of a pixel, and the parts of a pixel along its side.
float part_of(uint column, uint row, float parts) {
    vec2 corner = distant.corner * parts;
    float scale = distant.scale / parts;
    float left = place_of(column, corner.x, scale, distant.across);
    float right = place_of(column + 1u, corner.x, scale, distant.across);
    float top = place_of(row, corner.y, scale, distant.down);
    float bottom = place_of(row + 1u, corner.y, scale, distant.down);
    vec2 sum = vec2(0.0);
    for (uint y = uint(top); bottom > float(y); y++) {
        for (uint x = uint(left); right > float(x); x++) {
            uint texel = y * distant.width + x;
            float covered = drawn_identity[texel].x > 0u ? overlap(x, left, right) * overlap(y, top, bottom) : 0.0;
            sum += covered * vec2(drawn_radiance[texel].x, 1.0);
        }
    }
    float share = 1.0 / (scale * scale);
    float sky = 0.0;
#ifdef SKY
    vec2 place = (vec2(float(column), float(row)) + vec2(0.5)) / parts;
    sky = sky_radiance(around, normalize(vec3((place - distant.centre) / distant.focal, 1.0)));
#endif
    return share * sum.x + (1.0 - min(share * sum.y, 1.0)) * sky;
}
#endif

void main() {
    uint row = gl_WorkGroupID.x;
    float top = place_of(row, distant.corner.y, distant.scale, distant.down);
    float bottom = place_of(row + 1u, distant.corner.y, distant.scale, distant.down);
    float share = 1.0 / (distant.scale * distant.scale);
    for (uint column = gl_LocalInvocationID.x; column < distant.width; column += 64u) {
        float left = place_of(column, distant.corner.x, distant.scale, distant.across);
        float right = place_of(column + 1u, distant.corner.x, distant.scale, distant.across);
        vec2 pixel = vec2(float(column), float(row));
        vec2 centre = (pixel + vec2(0.5) - distant.corner) * distant.scale;
        vec3 sum = vec3(0.0);
        float nearest = 3e38;
        uint shown = 0u;
        for (uint y = uint(top); bottom > float(y); y++) {
            // Sums of rows, so that a sum of many texels keeps its digits.
            vec3 of_row = vec3(0.0);
            for (uint x = uint(left); right > float(x); x++) {
                uint texel = y * distant.width + x;
                float covered = drawn_identity[texel].x > 0u ? overlap(x, left, right) : 0.0;
                vec4 drawn = drawn_radiance[texel];
                of_row += covered * vec3(drawn.x, drawn.w, 1.0);
                vec2 off = vec2(float(x), float(y)) + vec2(0.5) - centre;
                float distance = covered > 0.0 ? dot(off, off) : 3e38;
                shown = distance < nearest ? texel : shown;
                nearest = min(nearest, distance);
            }
            sum += overlap(y, top, bottom) * of_row;
        }
        bool any = sum.z > 0.0;
        float coverage = min(share * sum.z, 1.0);
        float radiance = share * sum.x + (1.0 - coverage) * behind(pixel);
        vec4 drawn = drawn_radiance[shown];
        uint index = row * distant.width + column;
        image_radiance[index] = any
            ? vec4(radiance, drawn.y, drawn.z, share * sum.y)
            : vec4(radiance, 0.0, 0.0, 0.0);
#ifdef FINE
        for (uint j = 4u * row; j < 4u * row + 4u; j++) {
            uint i = 4u * column;
            fine[j * distant.width + column] =
                vec4(part_of(i, j, 4.0), part_of(i + 1u, j, 4.0), part_of(i + 2u, j, 4.0), part_of(i + 3u, j, 4.0));
        }
#endif
        image_identity[index] = any ? drawn_identity[shown] : uvec2(0u, 0u);
    }
}
