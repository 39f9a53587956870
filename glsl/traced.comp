#version 450
// Adds what each texel of an image reflects of the craft itself to its radiance. With SEVERAL the image is that of the mean over several samples of a pixel.
// With APART the reflected part is a value of its own. With HELD a path may go on in the next dispatch, and with RESUMED
// it began in an earlier one. One texel an invocation. Twin: src/raster/traced.rs.

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

// First texel, dispatches before this one, and the place of the sample in a texel.
layout(push_constant) uniform FirstBlock { uint first_texel; uint dispatches; vec2 sample_place; };
layout(set = 0, binding = 0) uniform ViewBlock { View view; };
layout(set = 0, binding = 12) uniform SurroundingsBlock { Surroundings around; };
// Front and back of each material.
layout(set = 0, binding = 7) readonly buffer ReflectorsBlock { Reflector reflectors[]; };
#ifndef RESUMED
// Normal of the visible face times depth, in the axes of the camera, and the node of the triangle's first corner plus 1,
// negative where the back is seen. 0 where no surface is.
layout(set = 0, binding = 1) readonly buffer SurfaceBlock { vec4 surfaces[]; };
// Material of each node times 4; plus 1 where the front is enclosed; plus 2 where the back is.
layout(set = 0, binding = 23) readonly buffer TraceNodesBlock { uint trace_nodes[]; };
#endif
// From the first texel.
#ifdef SEVERAL
layout(set = 0, binding = 2) buffer MeanBlock { vec2 mean_radiance[]; };
#else
layout(set = 0, binding = 2) buffer DrawnRadianceBlock { vec4 drawn_radiance[]; };
#endif

#include "traced.glsl"

#ifdef ROLLING
#define SHUTTER_BINDING 14
#include "shutter.glsl"

// A place (1 as its fourth value) or a direction (0) from the camera axes at a row to those at the first row, as the body moves between them.
vec3 at_first(vec4 seen, float share) {
    vec4 first = vec4(view.camera_from_body_x.w, view.camera_from_body_y.w, view.camera_from_body_z.w, 0.0);
    vec3 middle = vec3(shutter.middle_x.w, shutter.middle_y.w, shutter.middle_z.w);
    vec3 last = vec3(shutter.last_x.w, shutter.last_y.w, shutter.last_z.w);
    vec3 moved = seen.xyz - seen.w * pose_between(first.xyz, middle, last, share);
    vec3 x = pose_between(view.camera_from_body_x.xyz, shutter.middle_x.xyz, shutter.last_x.xyz, share);
    vec3 y = pose_between(view.camera_from_body_y.xyz, shutter.middle_y.xyz, shutter.last_y.xyz, share);
    vec3 z = pose_between(view.camera_from_body_z.xyz, shutter.middle_z.xyz, shutter.last_z.xyz, share);
    return to_camera_axes(x * moved.x + y * moved.y + z * moved.z) + seen.w * first.xyz;
}
#endif

#ifdef HELD
#define KEPT
#endif
#ifdef RESUMED
#define KEPT
#endif
#ifdef KEPT
// Paths from the first texel on, three vectors for each: start and weight; normal and temperature; direction seen, and the face.
layout(set = 0, binding = 24) buffer PathsBlock { vec4 paths[]; };
#endif

#ifdef RESUMED
Path resumed(uint own) {
    vec4 start = paths[3u * own];
    vec4 surface = paths[3u * own + 1u];
    vec4 seen = paths[3u * own + 2u];
    uint face = uint(seen.w);
    return Path(face >> 2u, face & 1u, (face >> 1u) & 1u, 0.0, surface.xyz, seen.xyz, start.xyz, surface.w, start.w, 0.0);
}
#else
// The path of a texel from the surface that it shows.
Path begun(uvec2 place) {
    vec4 surface = surfaces[place.y * tracing.surface_width + place.x];
    float depth = length(surface.xyz);
    if (depth == 0.0) {
        return Path(0u, 0u, 0u, 0.0, vec3(0.0), vec3(0.0), vec3(0.0), 0.0, 0.0, 0.0);
    }
    vec2 size = vec2(float(tracing.width), float(tracing.texels / tracing.width));
    vec2 clip = (2.0 * (vec2(place) + sample_place)) / size - vec2(1.0);
    vec3 ray = vec3((clip - view.clip_offset) / view.clip_scale, 1.0);
    uint node = uint(abs(surface.w)) - 1u;
    uint side = surface.w < 0.0 ? 1u : 0u;
    vec3 normal = surface.xyz / depth;
    vec3 to_camera = -normalize(ray);
    vec3 at = depth * ray;
#ifdef ROLLING
    float share = share_of_ray(ray.xy);
    normal = normalize(at_first(vec4(normal, 0.0), share));
    to_camera = normalize(at_first(vec4(to_camera, 0.0), share));
    at = at_first(vec4(at, 1.0), share);
#endif
    return path_from(around, trace_nodes[node], side, node, normal, to_camera, at);
}
#endif

void main() {
    uint own = gl_GlobalInvocationID.x;
    uint texel = first_texel + own;
    if (texel >= tracing.texels) {
        return;
    }
    uvec2 place = uvec2(texel % tracing.width, texel / tracing.width);
#ifdef RESUMED
    Path path = resumed(own);
#else
    Path path = begun(place);
#endif
    uint vertex = dispatches * tracing.vertices;
    uint end = path.weight > 0.0 ? vertex + tracing.vertices : 0u;
    while (vertex < end) {
        path = followed(path, around, 16u * place + uvec2(16.0 * sample_place), vertex);
        vertex++;
        end = path.weight > 0.0 ? end : 0u;
    }
#ifdef HELD
    paths[3u * own] = vec4(path.from, path.weight);
    paths[3u * own + 1u] = vec4(path.normal, path.temperature);
    paths[3u * own + 2u] = vec4(path.seen, float(4u * path.face + 2u * path.last + path.enclosed));
#endif
#ifdef SEVERAL
    mean_radiance[own].x += path.sum;
#else
    drawn_radiance[own].x += path.sum;
#ifdef APART
    drawn_radiance[own].w += path.sum;
#endif
#endif
}
