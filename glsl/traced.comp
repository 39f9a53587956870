#version 450
// Adds what each texel of an image reflects of the craft itself to its radiance. With SEVERAL the image is that of the mean over several samples of a pixel.
// With APART the reflected part is a value of its own. One texel an invocation. Twin: src/raster/traced.rs.

#include "types.glsl"
#include "planck.glsl"
#define BAND_BINDING 8
#include "band_table.glsl"
#ifdef TABLES
#define EMISSIVITY_BINDING 15
#include "emissivity.glsl"
#endif
#define DIMMED
#define LOBE_BINDING 13
#include "reflection.glsl"

layout(local_size_x = 64) in;

layout(push_constant) uniform FirstBlock { uint first_texel; };
layout(set = 0, binding = 0) uniform ViewBlock { View view; };
layout(set = 0, binding = 12) uniform SurroundingsBlock { Surroundings around; };
// Front and back of each material.
layout(set = 0, binding = 7) readonly buffer ReflectorsBlock { Reflector reflectors[]; };
// Normal of the visible face times depth, in the axes of the camera, and number of the face plus 1. 0 where no surface is.
layout(set = 0, binding = 1) readonly buffer SurfaceBlock { vec4 surfaces[]; };
// From the first texel.
#ifdef SEVERAL
layout(set = 0, binding = 2) buffer MeanBlock { vec2 mean_radiance[]; };
#else
layout(set = 0, binding = 2) buffer DrawnRadianceBlock { vec4 drawn_radiance[]; };
#endif

#include "traced.glsl"

void main() {
    uint own = gl_GlobalInvocationID.x;
    uint texel = first_texel + own;
    if (texel >= tracing.texels) {
        return;
    }
    uvec2 place = uvec2(texel % tracing.width, texel / tracing.width);
    vec4 surface = surfaces[place.y * tracing.surface_width + place.x];
    float depth = length(surface.xyz);
    if (depth == 0.0) {
        return;
    }
    vec2 size = vec2(float(tracing.width), float(tracing.texels / tracing.width));
    vec2 clip = (2.0 * vec2(place) + vec2(1.0)) / size - vec2(1.0);
    vec3 ray = vec3((clip - view.clip_offset) / view.clip_scale, 1.0);
    vec3 normal = surface.xyz / depth;
    vec3 to_camera = -normalize(ray);
    Reflector reflector = reflectors[uint(surface.w) - 1u];
    float factor = 1.0;
#ifdef TABLES
    factor = angle_factor(reflector, dot(normal, to_camera));
#endif
    float light = traced_share(around, reflector, factor, normal, to_camera, depth * ray, 16u * place + uvec2(8u));
#ifdef SEVERAL
    mean_radiance[own].x += light;
#else
    drawn_radiance[own].x += light;
#ifdef APART
    drawn_radiance[own].w += light;
#endif
#endif
}
