#version 450
// From the radiance of an image to digital numbers and counts of temperature. Four pixels an invocation. The words switch each effect on. Twin:
// src/thermal/sensor/twin.rs.

#include "types.glsl"
#include "sensor_types.glsl"
#include "sensor_noise.glsl"
#include "sensor_signal.glsl"

layout(local_size_x = 64) in;

layout(set = 0, binding = 0) uniform SensorBlock { Sensor sensor; };
#ifdef SPREAD
layout(set = 0, binding = 1) uniform SensorKernelBlock { vec4 kernel[1024]; };
layout(set = 0, binding = 2) readonly buffer SensorRowsBlock { vec4 rows[]; };
#else
layout(set = 0, binding = 2) readonly buffer SensorSeenBlock { vec4 seen[]; };
#endif
#ifdef HALO
layout(set = 0, binding = 3) readonly buffer SensorHaloBlock { float halo[]; };
#endif
#ifdef MAP
layout(set = 0, binding = 4) readonly buffer SensorVignettingBlock { vec4 vignetting[]; };
#endif
#ifdef LAG
// State of the bolometer, and the signal of the last image.
struct Bolometer {
    vec4 state;
    vec4 signal;
};
layout(set = 0, binding = 5) buffer SensorBolometerBlock { Bolometer bolometer[]; };
#endif
layout(set = 0, binding = 6) buffer SensorReadingBlock { uvec4 reading[]; };
#ifdef KELVIN
#include "planck.glsl"
#define BAND_BINDING 7
#include "band_table.glsl"
#define GUESS_BINDING 8
#include "brightness.glsl"

// Count of the radiometric output. The least normal number stands for radiances without a brightness temperature, and counts as none.
float count_of(float radiance) {
    float known = clamp(radiance, 1.2e-38, sensor.most_radiance);
    float counted = floor(brightness_temperature(known) * sensor.counts + 0.5);
    return radiance < 1.2e-38 ? 0.0 : min(counted, 65535.0);
}
#endif

#ifdef HALO
// The halo at a pixel, between the middles of four cells.
float halo_at(uint x, uint y) {
    vec2 middle = (vec2(float(x), float(y)) + 0.5) / float(sensor.cell) - 0.5;
    vec2 low = floor(middle);
    vec2 f = middle - low;
    vec2 last = vec2(float(sensor.cells_across), float(sensor.cells_down)) - 1.0;
    vec2 a = clamp(low, vec2(0.0), last);
    vec2 b = clamp(low + 1.0, vec2(0.0), last);
    uint top = uint(a.y) * sensor.cells_across;
    uint bottom = uint(b.y) * sensor.cells_across;
    uint left = uint(a.x);
    uint right = uint(b.x);
    float upper = halo[top + left] * (1.0 - f.x) + halo[top + right] * f.x;
    float lower = halo[bottom + left] * (1.0 - f.x) + halo[bottom + right] * f.x;
    return upper * (1.0 - f.y) + lower * f.y;
}
#endif

void main() {
    uint at = gl_GlobalInvocationID.x;
    if (at >= sensor.groups * sensor.height) {
        return;
    }
    uint y = at / sensor.groups;
    uint x = 4u * (at - y * sensor.groups);
#ifdef SPREAD
    int radius = int(sensor.radius);
    int last = 4 * int(sensor.height) - 1;
    uint group = at - y * sensor.groups;
    vec4 light = vec4(0.0);
    for (uint term = 0u; term < sensor.terms; term++) {
        uint weights = term * (2u * sensor.radius + 1u);
        uint plane = term * 4u * sensor.groups * sensor.height + group;
        for (int by = -radius; by <= radius; by++) {
            ivec4 row = clamp(4 * (int(y) + by) + ivec4(0, 1, 2, 3), ivec4(0), ivec4(last));
            vec4 weight = kernel[weights + uint(by + radius)];
            light += rows[plane + uint(row.x) * sensor.groups] * weight.x;
            light += rows[plane + uint(row.y) * sensor.groups] * weight.y;
            light += rows[plane + uint(row.z) * sensor.groups] * weight.z;
            light += rows[plane + uint(row.w) * sensor.groups] * weight.w;
        }
    }
#else
    uint first = y * sensor.width;
    uint last = sensor.width - 1u;
    vec4 light = vec4(
        seen[first + x].x,
        seen[first + min(x + 1u, last)].x,
        seen[first + min(x + 2u, last)].x,
        seen[first + min(x + 3u, last)].x
    );
#endif
#ifdef HALO
    vec4 stray = vec4(halo_at(x, y), halo_at(x + 1u, y), halo_at(x + 2u, y), halo_at(x + 3u, y));
    light += sensor.halo_share * (stray - light);
#endif
    vec4 vignette = vec4(1.0);
#ifdef COS4
    vignette = cos4(sensor, float(x), float(y));
#endif
#ifdef MAP
    vignette = vignetting[at];
#endif
    vec4 signal = signal_of_radiance(sensor, light, vignette);
#ifdef LAG
    // The signal changes evenly since the last image.
    Bolometer last_image = bolometer[at];
    vec4 state = signal + (last_image.state - last_image.signal) * sensor.decay + (last_image.signal - signal) * sensor.behind;
    bolometer[at].state = state;
    bolometer[at].signal = signal;
    signal = state;
#endif
#ifdef NOISE
    signal += sensor.noise * normal(random_words(sensor.seed, sensor.time_low, sensor.time_high, STREAM_TIME, at));
#endif
#ifdef PATTERN
    vec4 gain = sensor.gain_pattern * normal(random_words(sensor.serial, 0u, 0u, STREAM_GAIN, at));
    vec4 offset = sensor.offset_pattern * normal(random_words(sensor.serial, sensor.shutter, 0u, STREAM_OFFSET, at));
    vec4 drift = sensor.drift * normal(random_words(sensor.serial, sensor.shutter, 0u, STREAM_DRIFT, at));
    signal += gain * (signal - sensor.optics.w) + offset + drift;
#endif
    vec4 number = digital_number(sensor, signal);
#ifdef BAD
    uvec4 word = random_words(sensor.serial, 0u, 0u, STREAM_BAD, at);
    vec4 works = step(vec4(sensor.bad), vec4(word >> uvec4(8u)) * (1.0 / 16777216.0));
    number = mix(vec4(word & uvec4(1u)) * sensor.most, number, works);
#endif
    uvec4 read = uvec4(number);
#ifdef KELVIN
    vec4 radiance = radiance_of_signal(sensor, signal_of_number(sensor, number), vignette);
    vec4 counts = vec4(count_of(radiance.x), count_of(radiance.y), count_of(radiance.z), count_of(radiance.w));
    // A number at an end of the range tells no temperature.
    counts *= step(0.5, number) * step(number, vec4(sensor.most - 0.5));
    read = read | (uvec4(counts) << uvec4(16u));
#endif
    reading[at] = read;
}
