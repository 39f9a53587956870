#version 450
// Point spread along rows, for each separable term. Four pixels an invocation.

#include "sensor_types.glsl"

layout(local_size_x = 64) in;

layout(set = 0, binding = 0) uniform SensorBlock { Sensor sensor; };
layout(set = 0, binding = 1) uniform SensorKernelBlock { vec4 kernel[1024]; };
layout(set = 0, binding = 2) readonly buffer SensorSeenBlock { vec4 seen[]; };
layout(set = 0, binding = 3) buffer SensorRowsBlock { vec4 rows[]; };

void main() {
    uint at = gl_GlobalInvocationID.x;
    if (at >= sensor.groups * sensor.height) {
        return;
    }
    uint row = at / sensor.groups;
    int left = int(4u * (at - row * sensor.groups)) - int(sensor.radius);
    uint first = row * sensor.width;
    int last = int(sensor.width) - 1;
    uint taps = 2u * sensor.radius + 4u;
    for (uint term = 0u; term < sensor.terms; term++) {
        uint weights = term * (4u * sensor.radius + 5u);
        vec4 sum = vec4(0.0);
        for (uint tap = 0u; tap < taps; tap++) {
            uint column = uint(clamp(left + int(tap), 0, last));
            sum += seen[first + column].x * kernel[weights + tap];
        }
        rows[term * sensor.groups * sensor.height + at] = sum;
    }
}
