// Lookup position of a direction in the albedo table. Twin: src/environment/albedo.rs.

// Position in the table, in intervals from its corner. The axes of a normal are x to the Sun's side, z to nadir, y
// across.
struct AlbedoPosition {
    vec4 column;
    vec4 row;
    // Factor of the table value.
    vec4 scale;
};

AlbedoPosition albedo_position(Step step, vec4 nx, vec4 ny, vec4 nz) {
    vec3 nadir = step.nadir.xyz;
    vec3 sunward = step.sunward.xyz;
    vec3 across = step.across.xyz;
    vec4 x = nx * sunward.x + ny * sunward.y + nz * sunward.z;
    vec4 y = nx * across.x + ny * across.y + nz * across.z;
    vec4 z = nx * nadir.x + ny * nadir.y + nz * nadir.z;
    // A padding node has normal 0 and reads the centre.
    vec4 sum = max(abs(x) + abs(y) + abs(z), vec4(1e-6));
    float middle = 0.5 * step.albedo_resolution;
    vec4 scale = vec4(middle) / sum;
    return AlbedoPosition(x * scale + vec4(middle), z * scale + vec4(middle), sum);
}
