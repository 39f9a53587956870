// What a face reflects of the craft itself, by rays against its own triangles. The including shader declares `view`. Twin: src/raster/traced.rs.

#include "cosine.glsl"
#include "pcg.glsl"

layout(set = 0, binding = 19) uniform TracingBlock { Tracing tracing; };
layout(set = 0, binding = 20) readonly buffer TraceBoxesBlock { ShadowBox boxes[]; };
layout(set = 0, binding = 21) readonly buffer TraceTrianglesBlock { ShadowTriangle placed_triangles[]; };
// Nodes of the corners of these triangles, and their material.
layout(set = 0, binding = 22) readonly buffer TraceCornersBlock { uvec4 trace_corners[]; };
layout(set = 0, binding = 4) readonly buffer TemperatureBlock { float node_temperature[]; };

#include "walk.glsl"

// Draws of a direction of a rough mirror. Then its mirror direction stands for it.
const uint LOBE_DRAWS = 6u;
// Error of a position in the image, as a share of its distance.
const float PLACE_ERROR = 4e-6;

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

// A direction from which a face reflects light to `seen`, and whether it is that of a smooth mirror.
vec4 reflected_from(Reflector reflector, vec3 normal, vec3 seen, uvec2 pixel, uint draw) {
    vec4 at = drawn_numbers(pixel, draw);
    vec4 found = vec4(cosine_direction(normal, at.yz), 0.0);
#ifdef SPECULAR
    float straight = max(dot(normal, seen), 0.0);
    vec3 mirror = 2.0 * straight * normal - seen;
    bool mirrors = at.x < reflector.specular;
    vec4 specular = vec4(mirror, 1.0);
#ifdef ROUGH
    if (reflector.roughness > 0.0) {
        float steep = max(straight, LEAST_VIEW);
        vec3 along = seen - dot(seen, normal) * normal;
        float slant = length(along);
        vec3 x = slant > 1e-4 ? along / max(slant, 1e-4) : cosine_direction(normal, vec2(1.0, 0.5));
        vec3 y = cross(normal, x);
        specular = vec4(mirror, 0.0);
        uint tries = 0u;
        while (tries < LOBE_DRAWS) {
            vec3 light = facet_reflection(reflector.roughness, steep, at.yz);
            float share = light.z > 0.0 ? masking(light.z, reflector.roughness) : 0.0;
            tries++;
            if (at.w < share) {
                specular = vec4(light.x * x + light.y * y + light.z * normal, 0.0);
                tries = LOBE_DRAWS;
            }
            at = drawn_numbers(pixel, draw + tries);
        }
    }
#endif
    if (mirrors) {
        found = specular;
    }
#endif
    return found;
}

// Share of the light of a surface at a temperature that a face reflects, at a factor of the angle.
float kept_share(Reflector reflector, float factor, float temperature) {
#ifdef TABLES
    return 1.0 - factor * temperature_factor(reflector, temperature);
#else
    return 1.0 - reflector.emissivity;
#endif
}

// A face on the way of the light, in the axes of the camera, and what was found up to it.
struct Reflection {
    Reflector reflector;
    float factor;
    vec3 normal;
    vec3 seen;
    // Start of its ray, body frame.
    vec3 from;
    // Share of its light that arrives; 0 where the way has ended.
    float weight;
    float sum;
};

// Follows the light of a face to the next one. `last`: that one counts as black.
Reflection reflection_after(Reflection here, Surroundings around, uvec2 pixel, uint draw, bool last) {
    vec4 drawn = reflected_from(here.reflector, here.normal, here.seen, pixel, draw);
    vec3 direction = from_camera(drawn.xyz);
    Nearest hit = nearest_of(here.from, direction, here.weight > 0.0 ? tracing.boxes : 0u);
    Reflection next = here;
    next.weight = 0.0;
    if (hit.place != SPACE) {
        ShadowTriangle triangle = placed_triangles[hit.place];
        uvec4 corners = trace_corners[hit.place];
        float temperature = (1.0 - hit.u - hit.v) * node_temperature[corners.x]
            + hit.u * node_temperature[corners.y] + hit.v * node_temperature[corners.z];
        vec3 outward = normalize(cross(triangle.first.xyz, triangle.second.xyz));
        bool outside = dot(outward, direction) < 0.0;
        vec3 met = outside ? outward : -outward;
        Surroundings open = dimmed(around, here.reflector, here.factor);
#ifdef SUN
        // Its light on a rough surface is not drawn.
        open.sun_radiance = drawn.w > 0.0 ? open.sun_radiance : open.space_radiance;
#endif
        float kept = here.weight * kept_share(here.reflector, here.factor, temperature);
        next.reflector = reflectors[2u * corners.w + (outside ? 0u : 1u)];
        next.normal = to_camera_axes(met);
        next.seen = -drawn.xyz;
#ifdef TABLES
        next.factor = angle_factor(next.reflector, dot(next.normal, next.seen));
#endif
        vec3 place = triangle.corner.xyz + hit.u * triangle.first.xyz + hit.v * triangle.second.xyz;
        next.from = place + tracing.start * (met - direction);
        float light = band_radiance(temperature);
        if (!last) {
            light *= 1.0 - kept_share(next.reflector, next.factor, temperature);
            light += reflected_share(dimmed(around, next.reflector, next.factor), next.reflector, next.normal, next.seen);
        }
        next.sum = here.sum - here.weight * sky_radiance(open, drawn.xyz) + kept * light;
        next.weight = kept;
    }
    return next;
}

// Radiance of the craft in a reflection, beyond that of the surroundings which it hides. `place` and both directions are in the axes of the camera.
float traced_share(
    Surroundings around,
    Reflector reflector,
    float factor,
    vec3 normal,
    vec3 to_camera,
    vec3 place,
    uvec2 pixel
) {
    vec3 moved = place - vec3(view.camera_from_body_x.w, view.camera_from_body_y.w, view.camera_from_body_z.w);
    float lift = tracing.start + PLACE_ERROR * length(place);
    // What lies towards the camera is free, also beside an edge where two faces meet.
    vec3 from = from_camera(moved + lift * (normal + to_camera));
    Reflection first = Reflection(reflector, factor, normal, to_camera, from, 1.0, 0.0);
    Reflection second = reflection_after(first, around, pixel, 0u, false);
    return reflection_after(second, around, pixel, 8u, true).sum;
}
