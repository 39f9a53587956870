#version 450
// Power of each heater of a network in one pass over a step: with a thermostat, that of the share of the step in which the
// heater is on. It goes behind the temperatures of the drawn nodes, from where the nodes take it as they take a flux.

#include "network_types.glsl"

layout(local_size_x = 64) in;

layout(push_constant) uniform PassBlock { HeaterStep pass; };
// For each heater: slot of the sensor, place of its power among the temperatures; then the bits of the thresholds [K] and of
// the change of the sensor in a step by the heater [K].
layout(set = 0, binding = 0) readonly buffer OnePassHeatersBlock { uvec4 heaters[]; };
layout(set = 0, binding = 1) readonly buffer OnePassPowersBlock { float powers[]; };
// For each heater: whether it is on, whether the sensor has been on the near side of the threshold, share of the last step
// that it was on.
layout(set = 0, binding = 2) buffer OnePassSwitchesBlock { vec4 switches[]; };
// For each heater: its switches in the frame, then the bits of the times of the first ones since its start [s].
layout(set = 0, binding = 3) buffer OnePassLogBlock { uint log_words[]; };
layout(set = 0, binding = 5) readonly buffer GatheredBlock { float gathered[]; };
// Bases, then rests, of four nodes [K].
layout(set = 0, binding = 7) readonly buffer OnePassStatesBlock { float states[]; };
layout(set = 0, binding = 10) buffer TemperatureBlock { float temperature[]; };

const uint NO_SENSOR = 0xffffffffu;
const uint SWITCHES_AT_MOST = 1000u;
// Words of the log of a heater.
const uint LOGGED = 16u;

void log_switch(uint heater, float place) {
    uint first = LOGGED * heater;
    uint count = log_words[first] + 1u;
    if (count < LOGGED) {
        log_words[first + count] = floatBitsToUint(pass.start + place * pass.step);
    }
    log_words[first] = count;
}

// Share of the step that a heater is on. Twin: `State::duty` of src/thermal/network/one_pass/switching.rs. Temperatures
// are those above the lower threshold.
float duty(uint heater, float here, float band, float last, float gain) {
    vec4 state = switches[heater];
    bool on = state.x > 0.5;
    bool armed = state.y > 0.5;
    float free = last - gain * state.z;
    float place = 0.0;
    float sum = 0.0;
    for (uint count = 0u; count <= SWITCHES_AT_MOST; count++) {
        float past = on ? here - band : -here;
        armed = armed || past <= 0.0;
        bool found = armed && past > 0.0;
        float end = place;
        if (past <= 0.0) {
            float rate = pass.trial > 0u ? 0.0 : (on ? free + gain : free);
            float toward = on ? rate : -rate;
            if (toward > 0.0 && -past < toward * (1.0 - place)) {
                found = true;
                end = place - past / toward;
                here = on ? band : 0.0;
            }
        }
        bool ends = !found || count == SWITCHES_AT_MOST;
        end = ends ? 1.0 : end;
        sum += on ? end - place : 0.0;
        if (ends) {
            break;
        }
        on = !on;
        armed = false;
        place = end;
        log_switch(heater, place);
    }
    switches[heater] = vec4(on ? 1.0 : 0.0, armed ? 1.0 : 0.0, sum, 0.0);
    return sum;
}

void main() {
    uint heater = gl_GlobalInvocationID.x;
    if (heater >= pass.heaters) {
        return;
    }
    if (pass.first > 0u) {
        log_words[LOGGED * heater] = 0u;
    }
    uvec4 at = heaters[2u * heater];
    float share = 1.0;
    if (at.x != NO_SENSOR) {
        vec4 limits = uintBitsToFloat(heaters[2u * heater + 1u]);
        // The mean temperature is T plus half of the last change.
        uint place = 8u * (at.x / 4u) + at.x % 4u;
        float base = states[place];
        float rest = states[place + 4u];
        float last = 2.0 * ((gathered[at.x] - base) - rest);
        share = duty(heater, (base - limits.x) + rest, limits.y, last, limits.z);
    }
    temperature[at.y] = powers[heater] * share;
}
