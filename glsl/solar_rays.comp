#version 450
// Traces a ray from each node to one point of the Sun's disc through a tree of boxes. The first ray sets the share of a
// node, and later rays add to it. One node an invocation. Twin: src/environment/shadow/rays.rs.

#include "types.glsl"

layout(local_size_x = 64) in;

layout(push_constant) uniform SunRayBlock {
    SunRay ray;
    // Rows of body_from_joint: rotation in xyz, translation in w [m].
    vec4 body_from_joint_x;
    vec4 body_from_joint_y;
    vec4 body_from_joint_z;
};
layout(set = 0, binding = 1) readonly buffer PositionXBlock { float position_x[]; };
layout(set = 0, binding = 2) readonly buffer PositionYBlock { float position_y[]; };
layout(set = 0, binding = 3) readonly buffer PositionZBlock { float position_z[]; };
layout(set = 0, binding = 4) readonly buffer NormalXBlock { float normal_x[]; };
layout(set = 0, binding = 5) readonly buffer NormalYBlock { float normal_y[]; };
layout(set = 0, binding = 6) readonly buffer NormalZBlock { float normal_z[]; };
layout(set = 0, binding = 7) readonly buffer ShadowTreeBlock { ShadowBox shadow_tree[]; };
layout(set = 0, binding = 8) buffer VisibilityBlock { float visibility[]; };
layout(set = 0, binding = 9) readonly buffer ShadowTrianglesBlock { ShadowTriangle shadow_triangles[]; };

// Distance to a triangle, hit from either side (Moeller and Trumbore 1997), or -1.
float distance_to(ShadowTriangle triangle, vec3 from, vec3 direction) {
    vec3 p = cross(direction, triangle.second.xyz);
    float determinant = dot(triangle.first.xyz, p);
    float inverse = determinant == 0.0 ? 0.0 : 1.0 / determinant;
    vec3 to = from - triangle.corner.xyz;
    float u = dot(to, p) * inverse;
    vec3 q = cross(to, triangle.first.xyz);
    float v = dot(direction, q) * inverse;
    float reached = dot(triangle.second.xyz, q) * inverse;
    bool inside = min(u, min(v, 1.0 - u - v)) >= 0.0;
    return inside ? reached : -1.0;
}

bool is_hidden(vec3 from, vec3 direction) {
    vec3 inverse = vec3(1.0) / direction;
    uint count = ray.boxes;
    uint at = 0u;
    bool hidden = false;
    // A box precedes its children, so the walk is at most as long as the tree.
    while (at < count) {
        ShadowBox box = shadow_tree[at];
        vec3 a = (box.low - from) * inverse;
        vec3 b = (box.high - from) * inverse;
        vec3 near = min(a, b);
        vec3 far = max(a, b);
        float enters = max(near.x, max(near.y, near.z));
        float leaves = min(far.x, min(far.y, far.z));
        bool missed = leaves < max(enters, 0.0);
        uint triangles = missed ? 0u : box.triangles & 7u;
        // The loop is unrolled, because its iterations would count in the walk, which lavapipe stops after 65,535.
        if (triangles > 0u) {
            uint first = box.triangles >> 3u;
            uint last = first + triangles - 1u;
            float found = max(
                max(
                    distance_to(shadow_triangles[first], from, direction),
                    distance_to(shadow_triangles[min(first + 1u, last)], from, direction)
                ),
                max(
                    distance_to(shadow_triangles[min(first + 2u, last)], from, direction),
                    distance_to(shadow_triangles[last], from, direction)
                )
            );
            hidden = found > 0.0;
        }
        at = hidden ? count : (missed ? box.skip : at + 1u);
    }
    return hidden;
}

void main() {
    uint node = gl_GlobalInvocationID.x;
    // The tree is in the body frame, so the node is moved there by the pose of its joint.
    vec3 own_normal = vec3(normal_x[node], normal_y[node], normal_z[node]);
    vec4 own_position = vec4(position_x[node], position_y[node], position_z[node], 1.0);
    vec3 normal = vec3(
        dot(body_from_joint_x.xyz, own_normal),
        dot(body_from_joint_y.xyz, own_normal),
        dot(body_from_joint_z.xyz, own_normal)
    );
    vec3 position = vec3(
        dot(body_from_joint_x, own_position),
        dot(body_from_joint_y, own_position),
        dot(body_from_joint_z, own_position)
    );
    vec3 side = dot(normal, ray.sun.xyz) < 0.0 ? -normal : normal;
    vec3 from = position + side * ray.sun.w;
    float seen = is_hidden(from, ray.direction.xyz) ? 0.0 : ray.direction.w;
#ifdef FIRST
    visibility[node] = seen;
#else
    visibility[node] += seen;
#endif
}
