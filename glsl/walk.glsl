// The first triangle that a ray meets, by a walk through the tree of their boxes. The including shader declares `boxes` and
// `placed_triangles`. Twin: `Occluders::first` of src/environment/shadow/rays.rs.

const uint SPACE = 0xffffffffu;

// Nearest triangle so far: its place, distance, and the weights of its second and third corner.
struct Nearest {
    uint place;
    float distance;
    float u;
    float v;
};

Nearest nearer(Nearest found, uint place, vec3 from, vec3 direction) {
    ShadowTriangle triangle = placed_triangles[place];
    vec3 p = cross(direction, triangle.second.xyz);
    float determinant = dot(triangle.first.xyz, p);
    float inverse = determinant == 0.0 ? 0.0 : 1.0 / determinant;
    vec3 to = from - triangle.corner.xyz;
    float u = dot(to, p) * inverse;
    vec3 q = cross(to, triangle.first.xyz);
    float v = dot(direction, q) * inverse;
    float reached = dot(triangle.second.xyz, q) * inverse;
    bool inside = min(u, min(v, 1.0 - u - v)) >= 0.0;
    float counts = inside ? reached : -1.0;
    // Conditions do not short-circuit, so they are numbers.
    float gains = min(counts, found.distance - counts);
    if (gains > 0.0) {
        found = Nearest(place, reached, u, v);
    }
    return found;
}

Nearest nearest_of(vec3 from, vec3 direction, uint count_of_boxes) {
    vec3 inverse = vec3(1.0) / direction;
    Nearest found = Nearest(SPACE, 3e38, 0.0, 0.0);
    uint at = 0u;
    while (at < count_of_boxes) {
        ShadowBox box = boxes[at];
        vec3 a = (box.low - from) * inverse;
        vec3 b = (box.high - from) * inverse;
        vec3 near = min(a, b);
        vec3 far = max(a, b);
        float enters = max(near.x, max(near.y, near.z));
        float leaves_at = min(far.x, min(far.y, far.z));
        bool missed = min(leaves_at, found.distance) < max(enters, 0.0);
        uint count = missed ? 0u : box.triangles & 7u;
        // The loop is unrolled, because its iterations would count in the walk, which lavapipe stops after 65,535.
        if (count > 0u) {
            uint first = box.triangles >> 3u;
            uint last = first + count - 1u;
            found = nearer(found, first, from, direction);
            found = nearer(found, min(first + 1u, last), from, direction);
            found = nearer(found, min(first + 2u, last), from, direction);
            found = nearer(found, last, from, direction);
        }
        at = missed ? box.skip : at + 1u;
    }
    return found;
}
