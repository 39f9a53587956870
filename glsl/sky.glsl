// What surrounds the craft: planet, deep space and Sun. Twin: src/thermal/surroundings.rs.

// Sine of a disc's angular radius minus the angle between two unit vectors. It keeps its digits at the limb of discs of
// any size.
float within(vec3 direction, vec3 centre, float sine, float cosine) {
    return dot(direction, centre) * sine - length(cross(direction, centre)) * cosine;
}

// Radiance from a direction.
float sky_radiance(Surroundings around, vec3 direction) {
    float radiance = around.space_radiance;
#ifdef SUN
    bool sun = within(direction, around.sun.xyz, around.sun.w, around.sun_cosine) >= 0.0;
    radiance = sun ? around.sun_radiance : radiance;
#endif
    bool planet = within(direction, around.nadir.xyz, around.nadir.w, around.planet_cosine) >= 0.0;
    return planet ? around.planet_radiance : radiance;
}
