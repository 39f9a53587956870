// Emissivity of a face over angle and temperature, from tables. Twin: src/thermal/emissivity_table.rs.

const float EMISSIVITY_ANGLES = 129.0;
const float EMISSIVITY_TEMPERATURES = 129.0;

layout(set = 0, binding = EMISSIVITY_BINDING) readonly buffer EmissivitiesBlock { float emissivities[]; };

// Value at a place in [0, 1] of a table that begins at `first`.
float emissivity_read(uint first, float place, float entries) {
    float at = place * (entries - 1.0);
    float cell = min(floor(at), entries - 2.0);
    uint entry = first + uint(cell);
    return mix(emissivities[entry], emissivities[entry + 1u], at - cell);
}

// Factor at a cosine of the angle from the normal.
float angle_factor(Reflector reflector, float cosine) {
    return emissivity_read(uint(reflector.table), sqrt(clamp(cosine, 0.0, 1.0)), EMISSIVITY_ANGLES);
}

// Factor at a temperature [K].
float temperature_factor(Reflector reflector, float temperature) {
    float kelvin = max(temperature, 0.0);
    float place = kelvin / (kelvin + MIDDLE_TEMPERATURE);
    return emissivity_read(uint(reflector.table) + uint(EMISSIVITY_ANGLES), place, EMISSIVITY_TEMPERATURES);
}
