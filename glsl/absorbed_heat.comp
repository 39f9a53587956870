#version 450
// Heat that runs of nodes of one part absorb in a step [W], for the energy balance of a run. One workgroup sums a run. The
// f64 twin is `absorbed_heat` of src/simulation/energy.rs. Variants: FLUX: the nodes hold the flux that they absorb.
// TARGET: it follows from their targets. None: it follows from their temperatures, which are those of balance.

#include "types.glsl"

const uint LANES = 64u;

layout(local_size_x = 64) in;

layout(push_constant) uniform PassBlock { HeatPass pass; };
// For each run: first group, group after the last, bits of the emission of its nodes [W m-2 K-4].
layout(set = 0, binding = 0) readonly buffer HeatRunsBlock { uvec4 runs[]; };
// Areas over which the nodes absorb [m2].
layout(set = 0, binding = 1) readonly buffer HeatAreasBlock { vec4 areas[]; };
#ifdef TARGET
layout(set = 0, binding = 2) readonly buffer TargetBlock { vec4 values[]; };
#endif
#ifndef TARGET
layout(set = 0, binding = 2) readonly buffer TemperatureBlock { vec4 values[]; };
#endif
layout(set = 0, binding = 3) buffer AbsorbedHeatBlock { float absorbed[]; };

shared float sums[LANES];

void main() {
    uint run = pass.first + gl_WorkGroupID.x;
    uint lane = gl_LocalInvocationIndex;
    uvec4 groups = runs[run];
    float sum = 0.0;
    for (uint group = groups.x + lane; group < groups.y; group += LANES) {
        vec4 value = values[group];
#ifdef FLUX
        sum += dot(areas[group], value);
#endif
#ifndef FLUX
        vec4 squared = value * value;
        sum += dot(areas[group], squared * squared - vec4(pass.background_temperature_4));
#endif
    }
    sums[lane] = sum;
    barrier();
    if (lane == 0u) {
        float all = 0.0;
        for (uint i = 0u; i < LANES; i++) {
            all += sums[i];
        }
#ifndef FLUX
        all *= uintBitsToFloat(groups.z);
#endif
        absorbed[run] = all;
    }
}
