// Temperature between two steps.

// Temperatures at a share of the time from one step to the next [K].
vec4 between(vec4 earlier, vec4 later, float share) {
    return earlier * (1.0 - share) + later * share;
}
