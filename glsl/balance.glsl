// Radiative balance temperature of a surface, for four nodes at a time. Twin: src/thermal/balance.rs.

const float STEFAN_BOLTZMANN = 5.670374419e-8; // W m-2 K-4, CODATA 2018

// Balance temperature [K] for an absorbed flux [W/m2]. Two square roots are correctly rounded, but pow(x, 0.25) is not.
vec4 balance_temperature(vec4 absorbed, float emissivity, float background_temperature_4) {
    return sqrt(sqrt(absorbed / (emissivity * STEFAN_BOLTZMANN) + vec4(background_temperature_4)));
}
