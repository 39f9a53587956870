// Projection of nodes into the shadow map of the Sun. Twin: src/environment/shadow/depth_map.rs.

// Smallest cosine of incidence for the slope of a surface.
const float LEAST_COSINE = 0.01;

// Column, row and depth of a point.
vec3 texel_from_body(SunView view, vec3 point) {
    return vec3(
        dot(view.texel_from_body_x.xyz, point) + view.texel_from_body_x.w,
        dot(view.texel_from_body_y.xyz, point) + view.texel_from_body_y.w,
        dot(view.texel_from_body_z.xyz, point) + view.texel_from_body_z.w
    );
}

// A node in the shadow map: column, row and depth, and the slope of its surface's depth in columns and rows.
struct SeenNode {
    vec3 texel;
    vec2 slope;
};

SeenNode seen_node(SunView view, vec3 position, vec3 normal) {
    float facing = dot(normal, view.sun.xyz);
    vec3 side = facing < 0.0 ? -normal : normal;
    vec3 texel = texel_from_body(view, position + side * view.sun.w);
    float steepness = view.right.w / max(abs(facing), LEAST_COSINE);
    return SeenNode(texel, steepness * vec2(dot(side, view.right.xyz), dot(side, view.down.xyz)));
}
