// What a face reflects of the craft itself, by rays against its own triangles. Twin: src/raster/traced.rs.

#include "cosine.glsl"
#include "pcg.glsl"

layout(set = 0, binding = 19) uniform TracingBlock { Tracing tracing; };
layout(set = 0, binding = 20) readonly buffer TraceBoxBlock { ShadowBox boxes[]; };
layout(set = 0, binding = 21) readonly buffer TraceTriangleBlock { ShadowTriangle placed_triangles[]; };
// Nodes of the corners of these triangles, and their material.
layout(set = 0, binding = 22) readonly buffer TraceCornerBlock { uvec4 trace_corners[]; };
layout(set = 0, binding = 4) readonly buffer TemperatureBlock { float node_temperature[]; };

#include "walk.glsl"

// Reflections that are followed. What lies beyond the last one counts as black.
const uint TRACED_REFLECTIONS = 2u;
// Draws of a direction of a rough mirror. Then its mirror direction stands for it.
const uint LOBE_DRAWS = 6u;
// Error of a position in the image, as a share of its distance.
const float PLACE_ERROR = 4e-6;

vec3 from_camera(vec3 direction) {
    return tracing.camera_from_body_x.xyz * direction.x + tracing.camera_from_body_y.xyz * direction.y
        + tracing.camera_from_body_z.xyz * direction.z;
}

vec3 to_camera_axes(vec3 direction) {
    return vec3(
        dot(tracing.camera_from_body_x.xyz, direction),
        dot(tracing.camera_from_body_y.xyz, direction),
        dot(tracing.camera_from_body_z.xyz, direction)
    );
}

// Four numbers in (0, 1) of a draw for a ray of a place in the image.
vec4 drawn_numbers(uvec2 pixel, uint ray, uint draw) {
    uvec4 word = pcg4d(uvec4(pixel, ray * 64u + draw, tracing.word));
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
    float a = radius * cos(TWO_PI * at.y);
    float b = (1.0 - share) * sqrt(max(1.0 - a * a, 0.0)) + share * radius * sin(TWO_PI * at.y);
    vec3 normal = vec3(0.0, a, 0.0) + b * third + sqrt(max(1.0 - a * a - b * b, 0.0)) * stretched;
    vec3 facet = normalize(vec3(roughness * normal.x, roughness * normal.y, max(normal.z, 0.0)));
    return 2.0 * dot(seen, facet) * facet - seen;
}
#endif

// A direction from which a face reflects light to `seen`, and whether it is that of a smooth mirror.
vec4 reflected_from(Reflector reflector, vec3 normal, vec3 seen, uvec2 pixel, uint ray, uint draw) {
    vec4 at = drawn_numbers(pixel, ray, draw);
    vec4 found = vec4(cosine_direction(normal, at.yz), 0.0);
#ifdef SPECULAR
    float view = max(dot(normal, seen), 0.0);
    vec3 mirror = 2.0 * view * normal - seen;
    bool mirrors = at.x < reflector.specular;
    vec4 specular = vec4(mirror, 1.0);
#ifdef ROUGH
    if (reflector.roughness > 0.0) {
        float steep = max(view, LEAST_VIEW);
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
            at = drawn_numbers(pixel, ray, draw + tries);
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

// Radiance of the craft in a reflection, beyond that of the surroundings which it hides. `place` and both directions are in the axes of the camera.
float traced_share(Surroundings around, Reflector first, float first_factor, vec3 first_normal, vec3 to_camera, vec3 place, uvec2 pixel) {
    vec3 moved = place - vec3(tracing.camera_from_body_x.w, tracing.camera_from_body_y.w, tracing.camera_from_body_z.w);
    float lift = tracing.start + PLACE_ERROR * length(place);
    vec3 start = from_camera(moved + lift * first_normal);
    float sum = 0.0;
    for (uint ray = 0u; ray < tracing.rays; ray++) {
        Reflector reflector = first;
        float factor = first_factor;
        vec3 normal = first_normal;
        vec3 seen = to_camera;
        vec3 from = start;
        float weight = 1.0;
        uint reflection = 0u;
        while (reflection < TRACED_REFLECTIONS) {
            vec4 drawn = reflected_from(reflector, normal, seen, pixel, ray, 8u * reflection);
            vec3 direction = from_camera(drawn.xyz);
            Nearest hit = nearest_of(from, direction, tracing.boxes);
            reflection++;
            if (hit.place == SPACE) {
                reflection = TRACED_REFLECTIONS;
            } else {
                ShadowTriangle triangle = placed_triangles[hit.place];
                uvec4 corners = trace_corners[hit.place];
                float temperature = (1.0 - hit.u - hit.v) * node_temperature[corners.x]
                    + hit.u * node_temperature[corners.y] + hit.v * node_temperature[corners.z];
                vec3 outward = normalize(cross(triangle.first.xyz, triangle.second.xyz));
                bool outside = dot(outward, direction) < 0.0;
                vec3 met = outside ? outward : -outward;
                Surroundings open = dimmed(around, reflector, factor);
#ifdef SUN
                // Its light on a rough surface is not drawn.
                open.sun_radiance = drawn.w > 0.0 ? open.sun_radiance : open.space_radiance;
#endif
                float kept = weight * kept_share(reflector, factor, temperature);
                sum -= weight * sky_radiance(open, drawn.xyz);
                reflector = reflectors[2u * corners.w + (outside ? 0u : 1u)];
                normal = to_camera_axes(met);
                seen = -drawn.xyz;
                float light = band_radiance(temperature);
                if (reflection < TRACED_REFLECTIONS) {
#ifdef TABLES
                    factor = angle_factor(reflector, dot(normal, seen));
#endif
                    float share = kept_share(reflector, factor, temperature);
                    light = (1.0 - share) * light + reflected_share(dimmed(around, reflector, factor), reflector, normal, seen);
                }
                sum += kept * light;
                weight = kept;
                from = triangle.corner.xyz + hit.u * triangle.first.xyz + hit.v * triangle.second.xyz + tracing.start * met;
            }
        }
    }
    return sum / float(tracing.rays);
}
