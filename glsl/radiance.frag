#version 450
// In-band radiance of a pixel: emissivity of the face that is seen x blackbody at the interpolated temperature.

#include "types.glsl"
#include "planck.glsl"
#define BAND_BINDING 8
#include "band_table.glsl"

layout(set = 0, binding = 7) readonly buffer MaterialBlock { Material materials[]; };

layout(location = 0) in float node_temperature;
layout(location = 1) in float camera_depth;
layout(location = 2) flat in uint part;
layout(location = 3) flat in uint material;

layout(location = 0) out vec4 radiance_temperature_depth;
layout(location = 1) out uvec2 identity;

void main() {
    float emissivity = materials[material].emissivity;
    if (!gl_FrontFacing) {
        emissivity = materials[material].back_emissivity;
    }
    float radiance = emissivity * band_radiance(node_temperature);
    radiance_temperature_depth = vec4(radiance, node_temperature, camera_depth, 1.0);
    // 0 is the background.
    identity = uvec2(part + 1u, material + 1u);
}
