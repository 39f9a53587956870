#version 450
// Point spread along rows of texels, for each separable term. An invocation makes four pixels, and the four rows of texels in them.

#include "sensor_types.glsl"

layout(local_size_x = 64) in;

layout(set = 0, binding = 0) uniform SensorBlock { Sensor sensor; };
layout(set = 0, binding = 1) uniform SensorRowKernelBlock { vec4 row_kernel[1024]; };
// Radiance of the four texels of a row of texels in a pixel.
layout(set = 0, binding = 2) readonly buffer SensorFineBlock { vec4 fine[]; };
layout(set = 0, binding = 3) buffer SensorRowsBlock { vec4 rows[]; };

void main() {
    uint at = gl_GlobalInvocationID.x;
    if (at >= sensor.groups * sensor.height) {
        return;
    }
    uint y = at / sensor.groups;
    uint group = at - y * sensor.groups;
    int left = int(4u * group) - int(sensor.radius);
    int last = int(sensor.width) - 1;
    uint blocks = 2u * sensor.radius + 4u;
    for (uint term = 0u; term < sensor.terms; term++) {
        // Three blocks without weight stand before the weights of a row, and three behind.
        uint weights = term * (2u * sensor.radius + 7u) + 3u;
        for (uint row = 4u * y; row < 4u * y + 4u; row++) {
            uint first = row * sensor.width;
            vec4 sum = vec4(0.0);
            for (uint block = 0u; block < blocks; block++) {
                int column = left + int(block);
                vec4 seen = fine[first + uint(clamp(column, 0, last))];
                seen = column < 0 ? seen.xxxx : seen;
                seen = column > last ? seen.wwww : seen;
                uint tap = weights + block;
                sum += vec4(
                    dot(row_kernel[tap], seen),
                    dot(row_kernel[tap - 1u], seen),
                    dot(row_kernel[tap - 2u], seen),
                    dot(row_kernel[tap - 3u], seen)
                );
            }
            rows[(term * 4u * sensor.height + row) * sensor.groups + group] = sum;
        }
    }
}
