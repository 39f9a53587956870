#version 450
// Band radiance of a pixel: emissivity of the visible face times blackbody radiance at the interpolated temperature.
// With REFLECTIONS the face also reflects the planet, deep space and the Sun. With TABLES its emissivity depends on angle
// and temperature. With MAP the planet is not uniform. With TRACED it tells traced.comp
// what it shows. With APART the alpha channel is the reflected part. With IN_PIXELS light of their own changes the temperature
// of some pixels.

#include "types.glsl"
#include "planck.glsl"
#define BAND_BINDING 8
#include "band_table.glsl"

#ifdef TABLES
#define FINISHED
#define EMISSIVITY_BINDING 15
#include "emissivity.glsl"
#endif
#ifdef REFLECTIONS
#ifdef ROLLING
#define SHUTTER_BINDING 14
#define SHUTTER_SKY_BINDING 19
#include "shutter.glsl"
#endif
#define FINISHED
#define LOBE_BINDING 13
#include "reflection.glsl"
layout(set = 0, binding = 12) uniform SurroundingsBlock { Surroundings around; };
#endif

#ifdef FINISHED
// Front and back of each material.
layout(set = 0, binding = 7) readonly buffer ReflectorsBlock { Reflector reflectors[]; };
#ifdef MULTIPLE
layout(location = 2) smooth sample in vec3 normal;
#else
layout(location = 2) in vec3 normal;
#endif
#else
layout(set = 0, binding = 7) readonly buffer MaterialsBlock { Material materials[]; };
#endif

#ifdef IN_PIXELS
// The width of the image, or 0 where nothing changes; then for each pixel the change, and the part + 1 for which it holds.
layout(set = 0, binding = 19) readonly buffer PixelChangesBlock { vec2 pixel_changes[]; };
#endif

#ifdef MULTIPLE
// At every sample, because the centre of the texel may lie outside the triangle. naga ignores `sample` without `smooth`.
#ifdef FINISHED
layout(location = 0) smooth sample in vec4 temperature_depth;
#else
layout(location = 0) smooth sample in vec2 temperature_depth;
#endif
layout(location = 4) smooth sample in float unity;
#else
#ifdef FINISHED
layout(location = 0) in vec4 temperature_depth;
#else
layout(location = 0) in vec2 temperature_depth;
#endif
#endif
#ifdef TRACED
layout(location = 1) flat in uvec4 first_corner;
#else
layout(location = 1) flat in uvec3 first_corner;
#endif

#ifdef MEAN
// Averaged over the samples.
layout(location = 0) out vec2 radiance_coverage;
#ifdef TRACED
// Normal of the visible face times depth, in the axes of the camera, and the node of the triangle's first corner plus 1,
// negative where the back is seen.
layout(location = 1) out vec4 surface;
#endif
#else
layout(location = 0) out vec4 radiance_temperature_depth;
layout(location = 1) out uvec2 identity;
#ifdef TRACED
// As above.
layout(location = 2) out vec4 surface;
#endif
#endif

// Perspective interpolation has an error of up to 1.3e-6 of the temperature (lavapipe), which is 3e-5 of the radiance
// at 40 K. A temperature within this error of that of the triangle's first node is replaced by it.
const float INTERPOLATION_ERROR = 2e-6;

void main() {
    uint part = first_corner.x;
    uint material = first_corner.y;
    float corner_temperature = uintBitsToFloat(first_corner.z);
#ifdef FINISHED
    Reflector reflector = reflectors[2u * material + (gl_FrontFacing ? 0u : 1u)];
    float emissivity = reflector.emissivity;
#else
    float emissivity = materials[material].emissivity;
    if (!gl_FrontFacing) {
        emissivity = materials[material].back_emissivity;
    }
#endif
    float temperature = temperature_depth.x;
#ifdef MULTIPLE
    // lavapipe takes the perspective at the centre of the texel. That error is a factor of all values, 2e-3 on a plate of
    // 0.1 m in a pixel at 11 m. On a triangle seen edge-on that centre may lie where its plane meets that of the camera, so that no value is a number.
    bool known = unity > 1e-6 && unity < 1e6;
    temperature = known ? temperature / unity : corner_temperature;
#endif
    if (abs(temperature - corner_temperature) <= INTERPOLATION_ERROR * corner_temperature) {
        temperature = corner_temperature;
    }
#ifdef IN_PIXELS
    uint width = uint(pixel_changes[0].x);
    uint pixel = uint(gl_FragCoord.y) * width + uint(gl_FragCoord.x);
    vec2 change = pixel_changes[width == 0u ? 0u : 1u + pixel];
    temperature += change.y == float(part + 1u) ? change.x : 0.0;
#endif
#ifdef FINISHED
    vec3 sight = vec3(temperature_depth.zw, temperature_depth.y);
    vec3 across = normal;
#ifdef MULTIPLE
    sight = known ? sight : vec3(0.0, 0.0, 1.0);
    across = known ? across : vec3(0.0, 0.0, -1.0);
#endif
    vec3 to_camera = -normalize(sight);
    vec3 outward = across / max(length(across), 1e-20);
    vec3 facing = gl_FrontFacing ? outward : -outward;
#endif
#ifdef TABLES
    float factor = angle_factor(reflector, dot(facing, to_camera));
    emissivity = factor * temperature_factor(reflector, temperature);
#endif
    float radiance = emissivity * band_radiance(temperature);
#ifdef REFLECTIONS
    vec3 across_sky = facing;
    vec3 seen_from = to_camera;
#ifdef ROLLING
    float share = share_of_ray(sight.xy / max(sight.z, 1e-6));
    across_sky = sky_at_first(facing, share);
    seen_from = sky_at_first(to_camera, share);
#endif
#ifdef TABLES
    float reflected = reflected_share(dimmed(around, reflector, factor), reflector, across_sky, seen_from);
#else
    float reflected = (1.0 - emissivity) * reflected_share(around, reflector, across_sky, seen_from);
#endif
    radiance += reflected;
#endif
#ifdef TRACED
    float node = float(first_corner.w + 1u);
    surface = vec4(facing * temperature_depth.y, gl_FrontFacing ? node : -node);
#endif
#ifdef MEAN
    radiance_coverage = vec2(radiance, 1.0);
#else
#ifdef APART
    float alpha = reflected;
#else
    float alpha = 1.0;
#endif
    radiance_temperature_depth = vec4(radiance, temperature, temperature_depth.y, alpha);
    // 0 is the background.
    identity = uvec2(part + 1u, material + 1u);
#endif
}
