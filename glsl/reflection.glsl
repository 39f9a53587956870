// Radiance that a face reflects. Twin: src/thermal/surroundings.rs.

#include "planet.glsl"
#include "sky.glsl"

// `plate_view_factor` of planet.glsl for one plate.
float one_view_factor(float cos_tilt, float sine, float cosine) {
    float x = clamp(cos_tilt / sine, -1.0, 1.0);
    float w = sqrt((1.0 - x) * (1.0 + x));
    vec4 angles = arc_tangent(vec4(sine * w, w, 0.0, 0.0), vec4(cosine, -cosine * x, 1.0, 1.0));
    float cut = max(angles.x - sine * cosine * w + sine * sine * cos_tilt * angles.y, 0.0) * (1.0 / PI);
    float seen = cos_tilt >= sine ? sine * sine * cos_tilt : cut;
    return cos_tilt <= -sine ? 0.0 : seen;
}

#ifdef ROUGH
#define SPECULAR
#include "lobe.glsl"
#endif
#ifdef SMOOTH
#define SPECULAR
#endif

#ifdef MAP
const float MEAN_COLUMNS = 96.0;
const float MEAN_ROWS = 48.0;

layout(set = 0, binding = 18) readonly buffer PlanetMeansBlock { float planet_means[]; };

// Mean of the planet over the part of its disc that a kind of surface sees along a direction.
float planet_mean(float kind, vec3 direction) {
    MapPlace place = map_place(on_map(direction), MEAN_COLUMNS, MEAN_ROWS);
    uvec4 cells = place.cells + uvec4(uint(kind * MEAN_COLUMNS * (MEAN_ROWS + 2.0)));
    float above = mix(planet_means[cells.x], planet_means[cells.y], place.way.x);
    float below = mix(planet_means[cells.z], planet_means[cells.w], place.way.x);
    return mix(above, below, place.way.y);
}
#endif

#ifdef TABLES
#define DIMMED
#endif
#ifdef DIMMED
// The surroundings with what a face reflects of the light of each, at a factor of the angle.
Surroundings dimmed(Surroundings around, Reflector reflector, float factor) {
    Surroundings seen = around;
#ifdef TABLES
    float of_planet = 1.0 - factor * reflector.of_planet;
    float of_space = 1.0 - factor * reflector.of_space;
    float of_sun = 1.0 - factor * reflector.of_sun;
#else
    float of_planet = 1.0 - reflector.emissivity;
    float of_space = of_planet;
    float of_sun = of_planet;
#endif
    seen.planet_radiance = around.planet_radiance * of_planet;
    seen.space_radiance = around.space_radiance * of_space;
    seen.sun_radiance = around.sun_radiance * of_sun;
    seen.sun_irradiance = around.sun_irradiance * of_sun;
    return seen;
}
#endif

// Radiance of a face that reflects all. `normal` is that of the visible face, and `to_camera` leads to the camera; both
// have length 1.
float reflected_share(Surroundings around, Reflector reflector, vec3 normal, vec3 to_camera) {
    float contrast = around.planet_radiance - around.space_radiance;
#ifdef MAP
    contrast = around.planet_radiance * planet_mean(0.0, normal) - around.space_radiance;
#endif
    float planet = one_view_factor(dot(normal, around.nadir.xyz), around.nadir.w, around.planet_cosine);
    float diffuse = around.space_radiance + contrast * planet;
#ifdef SUN
    float light = dot(normal, around.sun.xyz);
    diffuse += around.sun_irradiance * max(light, 0.0) * (1.0 / PI);
#endif
#ifdef SPECULAR
    float view = max(dot(normal, to_camera), 0.0);
    vec3 mirror = 2.0 * view * normal - to_camera;
#ifdef SMOOTH
    float specular = sky_radiance(around, mirror);
#endif
#ifdef ROUGH
#ifdef MAP
    float kind = 1.0 + floor(reflector.lobe / LOBE_VALUES + 0.5);
    contrast = around.planet_radiance * planet_mean(kind, mirror) - around.space_radiance;
#endif
    float rough = around.space_radiance + contrast * lobe_share(around, reflector, normal, view, mirror);
#ifdef SUN
    rough += around.sun_irradiance * lobe_glint(around, reflector, normal, to_camera);
#endif
#ifdef SMOOTH
    specular = reflector.roughness > 0.0 ? rough : specular;
#else
    float specular = rough;
#endif
#endif
    // A diffuse face has no lobe, and what stands in its place may be no number.
    diffuse += reflector.specular > 0.0 ? reflector.specular * (specular - diffuse) : 0.0;
#endif
    return diffuse;
}
