// What a face reflects of the craft itself, by rays against its own triangles. The including shader declares `view`. Twin: src/raster/traced.rs.

#include "cosine.glsl"
#include "pcg.glsl"

layout(set = 0, binding = 19) uniform TracingBlock { Tracing tracing; };
layout(set = 0, binding = 20) readonly buffer TraceBoxesBlock { ShadowBox boxes[]; };
layout(set = 0, binding = 21) readonly buffer TraceTrianglesBlock { ShadowTriangle placed_triangles[]; };
// Nodes of the corners of these triangles, and what TraceNodes has for the first of them.
layout(set = 0, binding = 22) readonly buffer TraceCornersBlock { uvec4 trace_corners[]; };
layout(set = 0, binding = 4) readonly buffer TemperatureBlock { float node_temperature[]; };

#include "walk.glsl"

// Draws of a direction of a rough mirror.
const uint LOBE_DRAWS = 6u;
// Draws that belong to a surface of a path. The last one is for the Sun and for chance.
const uint DRAWS = 8u;
// Error of a position in the image, as a share of its distance.
const float PLACE_ERROR = 4e-6;
// Steps of a pixel to which a device rounds the corners of triangles. A face may be drawn so far beyond an edge where another one begins.
const float PIXEL_STEPS = 256.0;
// Heights over the plane of a triangle at which a ray may start, in distances between its start and its own surface.
const float OWN_LIFTS = 2.5;
// Cosine of the angle at which a skin is seen edge-on. A device rounds corners, so there it may show the back of a facet at the rim of a body.
const float EDGE_ON = 0.1;

// A surface on the way of the light, in the axes of the camera, and the light that was found up to it.
struct Path {
    // Number of its reflector.
    uint face;
    // 1 where it sees nothing but the craft.
    uint enclosed;
    // 1 where no ray leaves it.
    uint last;
    // Distance between the start of its rays and the surface, where that is the one in the image. 0 for others.
    float lift;
    vec3 normal;
    vec3 seen;
    // Start of its rays, body frame.
    vec3 from;
    float temperature;
    // Share of its light that arrives; 0 where the path has ended.
    float weight;
    float sum;
};

// A direction from which a face reflects light, its weight, and 1 for that of a smooth mirror.
struct Drawn {
    vec3 direction;
    float weight;
    float mirror;
};

vec3 from_camera(vec3 direction) {
    return view.camera_from_body_x.xyz * direction.x + view.camera_from_body_y.xyz * direction.y
        + view.camera_from_body_z.xyz * direction.z;
}

vec3 to_camera_axes(vec3 direction) {
    return vec3(
        dot(view.camera_from_body_x.xyz, direction),
        dot(view.camera_from_body_y.xyz, direction),
        dot(view.camera_from_body_z.xyz, direction)
    );
}

// Four numbers in (0, 1) of a draw for a place in the image.
vec4 drawn_numbers(uvec2 pixel, uint draw) {
    uvec4 word = pcg4d(uvec4(pixel, draw, tracing.word));
    return (vec4(word >> uvec4(8u)) + vec4(0.5)) * (1.0 / 16777216.0);
}

#ifdef ROUGH
// Direction of a visible facet's reflection (Heitz 2018), in axes of which the third is the normal and the first lies in the plane of the view.
vec3 facet_reflection(float roughness, float view, vec2 at) {
    float slant = sqrt(max(1.0 - view * view, 0.0));
    vec3 seen = vec3(slant, 0.0, view);
    vec3 stretched = normalize(vec3(roughness * slant, 0.0, view));
    vec3 third = vec3(-stretched.z, 0.0, stretched.x);
    float share = 0.5 * (1.0 + stretched.z);
    float radius = sqrt(at.x);
    float a = -radius * cos(TWO_PI * (at.y - 0.5));
    float turned = -radius * sin(TWO_PI * (at.y - 0.5));
    float b = (1.0 - share) * sqrt(max(1.0 - a * a, 0.0)) + share * turned;
    vec3 normal = vec3(0.0, a, 0.0) + b * third + sqrt(max(1.0 - a * a - b * b, 0.0)) * stretched;
    vec3 facet = normalize(vec3(roughness * normal.x, roughness * normal.y, max(normal.z, 0.0)));
    return 2.0 * dot(seen, facet) * facet - seen;
}
#endif

// A direction from which a face reflects light to `seen`.
Drawn reflected_from(Reflector reflector, vec3 normal, vec3 seen, uvec2 pixel, uint draw) {
    vec4 at = drawn_numbers(pixel, draw);
    Drawn drawn = Drawn(cosine_direction(normal, at.yz), 1.0, 0.0);
#ifdef SPECULAR
    float straight = max(dot(normal, seen), 0.0);
    bool mirrors = at.x < reflector.specular;
    Drawn specular = Drawn(2.0 * straight * normal - seen, 1.0, 1.0);
#ifdef ROUGH
    if (reflector.roughness > 0.0) {
        float steep = max(straight, LEAST_VIEW);
        vec3 along = seen - dot(seen, normal) * normal;
        float slant = length(along);
        vec3 x = slant > 1e-4 ? along / max(slant, 1e-4) : cosine_direction(normal, vec2(1.0, 0.5));
        vec3 y = cross(normal, x);
        specular.weight = 0.0;
        specular.mirror = 0.0;
        // The first draw that no facet hides. Where all are hidden no light comes, and the others weigh more.
        float hidden = 1.0 - lobe_sum(reflector, steep);
        uint tries = 0u;
        while (tries < LOBE_DRAWS) {
            vec3 light = facet_reflection(reflector.roughness, steep, at.yz);
            float share = light.z > 0.0 ? masking(light.z, reflector.roughness) : 0.0;
            tries++;
            if (at.w < share) {
                specular.direction = light.x * x + light.y * y + light.z * normal;
                specular.weight = 1.0;
                tries = LOBE_DRAWS;
            }
            at = drawn_numbers(pixel, draw + tries);
        }
        float squared = hidden * hidden;
        specular.weight *= 1.0 / (1.0 - squared * squared * squared);
    }
#endif
    if (mirrors) {
        drawn = specular;
    }
#endif
    return drawn;
}

// Share of the light of a surface at a temperature that a face reflects, at a factor of the angle.
float kept_share(Reflector reflector, float factor, float temperature) {
#ifdef TABLES
    return 1.0 - factor * temperature_factor(reflector, temperature);
#else
    return 1.0 - reflector.emissivity;
#endif
}

// Factor of the angle at which a face is seen.
float factor_of(Reflector reflector, vec3 normal, vec3 seen) {
#ifdef TABLES
    return angle_factor(reflector, dot(normal, seen));
#else
    return 1.0;
#endif
}

// Light of a face at a temperature that reflects only surfaces of its own temperature.
float cavity_light(Reflector reflector, float factor, float temperature) {
    return kept_share(reflector, factor, temperature) * band_radiance(temperature);
}

#ifdef SUN
// Sunlight that `reflected_share` has for a face. A smooth mirror shows the Sun's disc by its ray.
float sunlight(Surroundings around, Reflector reflector, vec3 normal, vec3 seen) {
    float light = dot(normal, around.sun.xyz);
    float diffuse = around.sun_irradiance * max(light, 0.0) * (1.0 / PI);
#ifdef SPECULAR
    float specular = 0.0;
#ifdef ROUGH
    if (reflector.roughness > 0.0) {
        specular = around.sun_irradiance * lobe_glint(around, reflector, normal, seen);
    }
#endif
    diffuse += reflector.specular > 0.0 ? reflector.specular * (specular - diffuse) : 0.0;
#endif
    return diffuse;
}

// A point of the Sun's disc for two numbers in (0, 1).
vec3 sun_point(Surroundings around, vec2 at) {
    vec3 sun = around.sun.xyz;
    vec3 x = cosine_direction(sun, vec2(1.0, 0.5));
    float angle = TWO_PI * (at.y - 0.5);
    return normalize(sun + around.sun.w * sqrt(at.x) * (cos(angle) * x + sin(angle) * cross(sun, x)));
}
#endif

// Whether a ray meets another surface than the one that it left. Interpolated normals lean beyond the plane of a triangle.
bool meets_another(Path here, Nearest hit) {
    ShadowTriangle triangle = placed_triangles[hit.place == SPACE ? 0u : hit.place];
    vec3 normal = normalize(cross(triangle.first.xyz, triangle.second.xyz));
    float height = abs(dot(here.from - triangle.corner.xyz, normal));
    // Across an edge lies another surface.
    float alike = abs(dot(to_camera_axes(normal), here.normal));
    float far = max(height - OWN_LIFTS * here.lift, 0.5 - alike);
    return hit.place == SPACE ? false : far >= 0.0;
}

// Follows the light of a surface to the next one. `vertex` counts the surfaces before it.
Path followed(Path here, Surroundings around, uvec2 pixel, uint vertex) {
    Reflector reflector = reflectors[here.face];
    float factor = factor_of(reflector, here.normal, here.seen);
    Surroundings open = dimmed(around, reflector, factor);
    Path next = here;
    vec4 chance = drawn_numbers(pixel, DRAWS * vertex + DRAWS - 1u);
#ifdef SUN
    float light_of_sun = here.weight * sunlight(open, reflector, here.normal, here.seen);
    vec3 to_sun = from_camera(sun_point(around, chance.xy));
    Nearest before_sun = nearest_of(here.from, to_sun, light_of_sun > 0.0 ? tracing.boxes : 0u);
    // The surroundings of an open surface hold its sunlight already.
    float missing = here.enclosed > 0u ? 1.0 : 0.0;
    next.sum += (missing - (meets_another(here, before_sun) ? 1.0 : 0.0)) * light_of_sun;
#endif
    Drawn drawn = reflected_from(reflector, here.normal, here.seen, pixel, DRAWS * vertex);
    // Chance lets a path go on with the probability of its weight.
    float survives = chance.z < here.weight ? max(here.weight, 1.0) : 0.0;
    float weight = drawn.weight * (vertex < tracing.roulette ? here.weight : survives);
    weight = here.last > 0u ? 0.0 : weight;
    vec3 direction = from_camera(drawn.direction);
    Nearest hit = nearest_of(here.from, direction, weight > 0.0 ? tracing.boxes : 0u);
#ifdef SUN
    // Sunlight on a rough surface has a ray of its own.
    open.sun_radiance = drawn.mirror > 0.0 ? open.sun_radiance : open.space_radiance;
#endif
    float sky = sky_radiance(open, drawn.direction);
    float counted = here.enclosed > 0u ? cavity_light(reflector, factor, here.temperature) : sky;
    next.weight = 0.0;
    if (meets_another(here, hit)) {
        ShadowTriangle triangle = placed_triangles[hit.place];
        uvec4 corners = trace_corners[hit.place];
        float temperature = (1.0 - hit.u - hit.v) * node_temperature[corners.x]
            + hit.u * node_temperature[corners.y] + hit.v * node_temperature[corners.z];
        vec3 outward = normalize(cross(triangle.first.xyz, triangle.second.xyz));
        bool outside = dot(outward, direction) < 0.0;
        vec3 normal = outside ? outward : -outward;
        uint side = outside ? 0u : 1u;
        next.face = 2u * (corners.w >> 3u) + side;
        next.enclosed = (corners.w >> side) & 1u;
        next.lift = 0.0;
        next.normal = to_camera_axes(normal);
        next.seen = -drawn.direction;
        next.temperature = temperature;
        vec3 place = triangle.corner.xyz + hit.u * triangle.first.xyz + hit.v * triangle.second.xyz;
        next.from = place + tracing.start * (normal - direction);
        Reflector there = reflectors[next.face];
        float beyond = factor_of(there, next.normal, next.seen);
        float light = band_radiance(temperature);
        if (next.enclosed == 0u) {
            light *= 1.0 - kept_share(there, beyond, temperature);
            light += reflected_share(dimmed(around, there, beyond), there, next.normal, next.seen);
        }
        float kept = kept_share(reflector, factor, temperature);
        next.sum += weight * (kept * light - counted);
        next.weight = weight * kept;
        next.last = max(vertex + 1u < tracing.bounces ? 0u : 1u, next.weight < tracing.least ? 1u : 0u);
#ifndef SUN
        next.weight = next.last > 0u ? 0.0 : next.weight;
#endif
    } else {
        next.sum += weight * (sky - counted);
    }
    return next;
}

#ifndef RESUMED
// The path from a surface that the image shows. `place` and both directions are in the axes of the camera, and `code` is what
// TraceNodes has for its node.
Path path_from(Surroundings around, uint code, uint shown, uint node, vec3 facing, vec3 to_camera, vec3 place) {
    // The front of a skin whose back shows at its rim.
    bool at_rim = (code & 4u) > 0u && shown == 1u && dot(facing, to_camera) < EDGE_ON;
    uint side = at_rim ? 0u : shown;
    vec3 normal = at_rim ? -facing : facing;
    vec3 moved = place - vec3(view.camera_from_body_x.w, view.camera_from_body_y.w, view.camera_from_body_z.w);
    float step = 2.0 / (PIXEL_STEPS * float(tracing.width) * view.clip_scale.x);
    float lift = tracing.start + (PLACE_ERROR + step) * length(place);
    // What lies towards the camera is free, also beside an edge where two faces meet.
    vec3 from = from_camera(moved + lift * (normal + to_camera));
    uint face = 2u * (code >> 3u) + side;
    uint enclosed = (code >> side) & 1u;
    float temperature = node_temperature[node];
    float sum = 0.0;
    if (enclosed > 0u) {
        Reflector reflector = reflectors[face];
        float factor = factor_of(reflector, normal, to_camera);
        sum = cavity_light(reflector, factor, temperature)
            - reflected_share(dimmed(around, reflector, factor), reflector, normal, to_camera);
    }
    uint last = tracing.bounces == 0u ? 1u : 0u;
    return Path(face, enclosed, last, lift, normal, to_camera, from, temperature, 1.0, sum);
}
#endif
