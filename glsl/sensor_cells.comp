#version 450
// Mean radiance of the cells of the halo's grid. Twin: HaloGrid::cells in src/thermal/sensor/halo.rs.

#include "sensor_types.glsl"

layout(local_size_x = 64) in;

layout(set = 0, binding = 0) uniform SensorBlock { Sensor sensor; };
layout(set = 0, binding = 1) readonly buffer SensorSeenBlock { vec4 seen[]; };
layout(set = 0, binding = 2) buffer SensorCellsBlock { float cells[]; };

void main() {
    uint at = gl_GlobalInvocationID.x;
    if (at >= sensor.cells_across * sensor.cells_down) {
        return;
    }
    uint row = at / sensor.cells_across;
    uint left = (at - row * sensor.cells_across) * sensor.cell;
    uint top = row * sensor.cell;
    uint right = min(left + sensor.cell, sensor.width);
    uint bottom = min(top + sensor.cell, sensor.height);
    float sum = 0.0;
    for (uint y = top; y < bottom; y++) {
        for (uint x = left; x < right; x++) {
            sum += seen[y * sensor.width + x].x;
        }
    }
    cells[at] = sum / float((right - left) * (bottom - top));
}
