// Where a point is in camera axes at the time of the row that it appears in (rolling shutter). The including shader defines the binding as
// SHUTTER_BINDING. The word BROWN or FISHEYE selects the distortion. Twin: src/lens/rolling.rs.

layout(set = 0, binding = SHUTTER_BINDING) uniform ShutterBlock { Shutter shutter; };

// The row at the middle of the image and its motion converge by the share of the image that a point moves in the time of all rows.
const uint ROW_ITERATIONS = 6u;

// Share of the image above the row of a ray: 0 at the first row and 1 at the last.
float share_above(vec2 ray) {
    float y = ray.y;
#ifdef BROWN
    float r2 = dot(ray, ray);
    vec4 a = shutter.first_numbers;
    vec4 b = shutter.second_numbers;
    vec4 c = shutter.third_numbers;
    float radial = (1.0 + r2 * (a.x + r2 * (a.y + r2 * b.x))) / (1.0 + r2 * (b.y + r2 * (b.z + r2 * b.w)));
    y = ray.y * radial + a.z * (r2 + 2.0 * ray.y * ray.y) + 2.0 * a.w * ray.x * ray.y + r2 * (c.z + r2 * c.w);
#endif
#ifdef FISHEYE
    float r = max(length(ray), 1e-6);
    float angle = atan(r);
    float a2 = angle * angle;
    vec4 k = shutter.first_numbers;
    y = ray.y * angle * (1.0 + a2 * (k.x + a2 * (k.y + a2 * (k.z + a2 * k.w)))) / r;
#endif
    return shutter.row_scale * y + shutter.row_offset;
}

// The pose between the first, the middle and the last row is quadratic in time.
vec3 pose_between(vec3 first, vec3 middle, vec3 last, float share) {
    return first * ((1.0 - share) * (1.0 - 2.0 * share)) + middle * (4.0 * share * (1.0 - share))
        + last * (share * (2.0 * share - 1.0));
}

// Share of the image above the row that sees a ray. Rays beyond the frame have no row: they take that of the nearest ray of the frame.
float share_of_ray(vec2 ray) {
    return clamp(share_above(clamp(ray, shutter.field.xy, shutter.field.zw)), -1.0, 2.0);
}

// Where a position or, with 0 as its fourth value, a direction is in camera axes at the time of the middle row.
vec3 at_middle(vec4 position) {
    return vec3(
        dot(shutter.middle_x, position),
        dot(shutter.middle_y, position),
        dot(shutter.middle_z, position)
    );
}

// The same at the time of the last row.
vec3 at_last(vec4 position) {
    return vec3(dot(shutter.last_x, position), dot(shutter.last_y, position), dot(shutter.last_z, position));
}

// Share of the image above the row that sees a point, from where it is at the three rows. Points behind the camera have no row.
float share_of_point(vec3 first, vec3 middle, vec3 last) {
    float share = 0.5;
    for (uint i = 0u; i < ROW_ITERATIONS; i++) {
        vec3 camera = pose_between(first, middle, last, share);
        share = share_of_ray(camera.xy / max(camera.z, 1e-6));
    }
    return share;
}

// A point in camera axes. `first` is where it is at the first row.
vec3 rolled(vec4 position, vec3 first) {
    vec3 middle = at_middle(position);
    vec3 last = at_last(position);
    return pose_between(first, middle, last, share_of_point(first, middle, last));
}

#ifdef SHUTTER_SKY_BINDING
struct ShutterSky {
    vec4 middle_x;
    vec4 middle_y;
    vec4 middle_z;
    vec4 last_x;
    vec4 last_y;
    vec4 last_z;
};
layout(set = 0, binding = SHUTTER_SKY_BINDING) uniform ShutterSkyBlock { ShutterSky shutter_sky; };

// A direction in the sky from the camera axes at a row to those at the first row.
vec3 sky_at_first(vec3 direction, float share) {
    vec3 middle = vec3(
        dot(shutter_sky.middle_x.xyz, direction),
        dot(shutter_sky.middle_y.xyz, direction),
        dot(shutter_sky.middle_z.xyz, direction)
    );
    vec3 last = vec3(
        dot(shutter_sky.last_x.xyz, direction),
        dot(shutter_sky.last_y.xyz, direction),
        dot(shutter_sky.last_z.xyz, direction)
    );
    return normalize(pose_between(direction, middle, last, share));
}
#endif
