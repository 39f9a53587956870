#version 450
// Reads a node from the storage buffers and transforms it to clip coordinates.

#include "types.glsl"

layout(set = 0, binding = 0) uniform ViewBlock { View view; };
layout(set = 0, binding = 1) readonly buffer PositionXBlock { float position_x[]; };
layout(set = 0, binding = 2) readonly buffer PositionYBlock { float position_y[]; };
layout(set = 0, binding = 3) readonly buffer PositionZBlock { float position_z[]; };
layout(set = 0, binding = 4) readonly buffer TemperatureBlock { float temperature[]; };
layout(set = 0, binding = 5) readonly buffer GroupMaterialBlock { uint group_material[]; };
layout(set = 0, binding = 6) readonly buffer GroupPartBlock { uint group_part[]; };

#ifdef GATHERED
// The place in a pixel that the sample shows, from its upper left corner.
layout(push_constant) uniform PlaceBlock { vec2 sample_place; };
#endif

#ifdef ROLLING
#define SHUTTER_BINDING 14
#include "shutter.glsl"
#endif

#ifdef NORMALS
layout(set = 0, binding = 9) readonly buffer NormalXBlock { float normal_x[]; };
layout(set = 0, binding = 10) readonly buffer NormalYBlock { float normal_y[]; };
layout(set = 0, binding = 11) readonly buffer NormalZBlock { float normal_z[]; };
// Normal in the axes of the camera.
layout(location = 2) out vec3 normal;
// Temperature, depth, and the position across the axis of the camera. A location of its own would cost lavapipe time for every triangle.
layout(location = 0) out vec4 temperature_depth;
#else
layout(location = 0) out vec2 temperature_depth;
#endif
#ifdef MULTIPLE
// 1, which shows the error of an interpolation.
layout(location = 4) out float unity;
#endif
// Part, material, and the bits of the first corner's temperature. With TRACED also the node of that corner.
#ifdef TRACED
layout(location = 1) flat out uvec4 first_corner;
#else
layout(location = 1) flat out uvec3 first_corner;
#endif

void main() {
    uint node = uint(gl_VertexIndex);
    vec4 position = vec4(position_x[node], position_y[node], position_z[node], 1.0);
    vec3 camera = vec3(
        dot(view.camera_from_body_x, position),
        dot(view.camera_from_body_y, position),
        dot(view.camera_from_body_z, position)
    );
#ifdef ROLLING
    vec3 middle = at_middle(position);
    vec3 last = at_last(position);
    float share = share_of_point(camera, middle, last);
    camera = pose_between(camera, middle, last, share);
#endif
    // Depth is reversed, with the far plane at infinity.
    gl_Position = vec4(
        view.clip_scale.x * camera.x + view.clip_offset.x * camera.z,
        view.clip_scale.y * camera.y + view.clip_offset.y * camera.z,
        view.near,
        camera.z
    );
#ifdef GATHERED
    gl_Position.xy += (vec2(1.0) - 2.0 * sample_place) / view.size * camera.z;
#endif
    float own = temperature[node];
#ifdef NORMALS
    temperature_depth = vec4(own, camera.z, camera.xy);
#else
    temperature_depth = vec2(own, camera.z);
#endif
#ifdef TRACED
    first_corner = uvec4(group_part[node / 4u], group_material[node / 4u], floatBitsToUint(own), node);
#else
    first_corner = uvec3(group_part[node / 4u], group_material[node / 4u], floatBitsToUint(own));
#endif
#ifdef MULTIPLE
    unity = 1.0;
#endif
#ifdef NORMALS
    vec3 outward = vec3(normal_x[node], normal_y[node], normal_z[node]);
    normal = vec3(
        dot(view.camera_from_body_x.xyz, outward),
        dot(view.camera_from_body_y.xyz, outward),
        dot(view.camera_from_body_z.xyz, outward)
    );
#ifdef ROLLING
    vec4 direction = vec4(outward, 0.0);
    normal = pose_between(normal, at_middle(direction), at_last(direction), share);
#endif
#endif
}
