// Rough mirrors, from the tables of their lobes. Twin: src/thermal/lobe.rs, which also makes the tables.

const float VIEWS = 33.0;
const float SIDES = 17.0;
const float LIMBS = 65.0;
const float LOBE_VALUES = VIEWS * SIDES * LIMBS + VIEWS;
const float LEAST_VIEW = 1e-3;

layout(set = 0, binding = LOBE_BINDING) readonly buffer LobesBlock { float lobes[]; };

// A place between two nodes of an axis: the first one and the way to the next.
vec2 between(float place, float nodes) {
    float cell = min(floor(place), nodes - 2.0);
    return vec2(cell, place - cell);
}

// Place of a view among the nodes of the table.
float place_of(float view) {
    return sqrt(max(1.0 - sqrt(view), 0.0)) * (VIEWS - 1.0);
}

float along_limb(uint first, float way) {
    return mix(lobes[first], lobes[first + 1u], way);
}

// Share of a lobe that meets the planet.
float lobe_share(Surroundings around, Reflector reflector, vec3 normal, float view, vec3 mirror) {
    vec3 nadir = around.nadir.xyz;
    float along = dot(mirror, nadir);
    float across = length(cross(mirror, nadir));
    float slant = sqrt(max((1.0 - view) * (1.0 + view), 0.0));
    float beside = clamp((dot(normal, nadir) - view * along) / max(slant * across, 1e-20), -1.0, 1.0);
    float sine = along * around.nadir.w - across * around.planet_cosine;
    float cosine = along * around.planet_cosine + across * around.nadir.w;

    float angle = sine / max(1.0 + cosine, 1e-6);
    vec2 limb = between(0.5 * (angle / max(reflector.roughness + abs(angle), 1e-20) + 1.0) * (LIMBS - 1.0), LIMBS);
    vec2 side = between(0.5 * (beside + 1.0) * (SIDES - 1.0), SIDES);
    vec2 seen = between(place_of(view), VIEWS);
    uint first = uint(reflector.lobe) + uint((seen.x * SIDES + side.x) * LIMBS + limb.x);
    uint next_side = uint(LIMBS);
    uint next_view = uint(SIDES * LIMBS);
    float here = mix(along_limb(first, limb.y), along_limb(first + next_side, limb.y), side.y);
    first += next_view;
    float there = mix(along_limb(first, limb.y), along_limb(first + next_side, limb.y), side.y);
    return mix(here, there, seen.y);
}

// Share of the facets that are not hidden (Smith, GGX).
float masking(float cosine, float roughness) {
    float square = roughness * roughness;
    return 2.0 * cosine / (cosine + sqrt(square + (1.0 - square) * cosine * cosine));
}

// Sum of the lobe over the hemisphere.
float lobe_sum(Reflector reflector, float view) {
    vec2 cell = between(place_of(view), VIEWS);
    uint sums = uint(reflector.lobe) + uint(VIEWS * SIDES * LIMBS) + uint(cell.x);
    return mix(lobes[sums], lobes[sums + 1u], cell.y);
}

// Reflected radiance over irradiance across its rays for the light of the Sun's disc. Slopes of facets that reflect the Sun fill a disc, taken as round, over which the facets are integrated.
float lobe_glint(Surroundings around, Reflector reflector, vec3 normal, vec3 to_camera) {
    float view = max(dot(normal, to_camera), LEAST_VIEW);
    float light = dot(normal, around.sun.xyz);
    float lit = max(light, 1e-6);
    vec3 middle = to_camera + around.sun.xyz;
    middle /= max(length(middle), 1e-20);
    float cosine = max(dot(normal, middle), 1e-6);
    // A cross product keeps small angles exact.
    float slope = length(cross(normal, middle)) / cosine;
    float square = reflector.roughness * reflector.roughness;
    float disc = around.sun.w * around.sun.w / (4.0 * max(dot(middle, around.sun.xyz), LEAST_VIEW));
    float beyond = slope * slope + square - disc;
    float root = sqrt(beyond * beyond + 4.0 * square * disc);
    float share = beyond >= 0.0 ? 2.0 * square / (root * (root + beyond)) : (root - beyond) / (2.0 * root * disc);
    float facets = share / (PI * cosine * cosine * cosine * cosine);
    float glint = facets * masking(view, reflector.roughness) * masking(lit, reflector.roughness) / (4.0 * view * lobe_sum(reflector, view));
    return light > 0.0 ? glint : 0.0;
}
