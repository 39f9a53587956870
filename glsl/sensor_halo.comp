#version 450
// The halo's Gaussian over the cells. Twin: HaloGrid::halo in src/thermal/sensor/halo.rs.

#include "sensor_types.glsl"

layout(local_size_x = 64) in;

layout(set = 0, binding = 0) uniform SensorBlock { Sensor sensor; };
layout(set = 0, binding = 1) uniform SensorKernelBlock { vec4 kernel[1024]; };
layout(set = 0, binding = 2) readonly buffer SensorCellsBlock { float cells[]; };
layout(set = 0, binding = 3) buffer SensorHaloBlock { float halo[]; };

void main() {
    uint at = gl_GlobalInvocationID.x;
    if (at >= sensor.cells_across * sensor.cells_down) {
        return;
    }
    int across = int(sensor.cells_across);
    int row = int(at) / across;
    int column = int(at) - row * across;
    int reach = int(sensor.reach);
    float sum = 0.0;
    for (int dy = -reach; dy <= reach; dy++) {
        int first = clamp(row + dy, 0, int(sensor.cells_down) - 1) * across;
        float line = 0.0;
        for (int dx = -reach; dx <= reach; dx++) {
            float weight = kernel[sensor.halo_weights + uint(abs(dx))].x;
            line += weight * cells[uint(first + clamp(column + dx, 0, across - 1))];
        }
        sum += kernel[sensor.halo_weights + uint(abs(dy))].x * line;
    }
    halo[at] = sum;
}
