// What surrounds the craft: planet, deep space and Sun. Twin: src/thermal/surroundings.rs.

// Sine of a disc's angular radius minus the angle between two unit vectors. It keeps its digits at the limb of discs of
// any size.
float within(vec3 direction, vec3 centre, float sine, float cosine) {
    return dot(direction, centre) * sine - length(cross(direction, centre)) * cosine;
}

#ifdef MAP
#include "planet_map.glsl"
#endif

// Radiance from a direction.
float sky_radiance(Surroundings around, vec3 direction) {
    float radiance = around.space_radiance;
#ifdef SUN
    bool sun = within(direction, around.sun.xyz, around.sun.w, around.sun_cosine) >= 0.0;
    radiance = sun ? around.sun_radiance : radiance;
#endif
    float inside = within(direction, around.nadir.xyz, around.nadir.w, around.planet_cosine);
    float planet = around.planet_radiance;
#ifdef MAP
    planet *= planet_seen(around, direction, inside);
#endif
    return inside >= 0.0 ? planet : radiance;
}
