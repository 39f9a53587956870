#version 450
// Radiance of planet, deep space and Sun behind the craft. With MEAN it is averaged over the samples of a texel, and no surface covers them.

#include "types.glsl"
#include "sky.glsl"

layout(set = 0, binding = 0) uniform ViewBlock { View view; };
layout(set = 0, binding = 12) uniform SurroundingsBlock { Surroundings around; };

#ifdef ROLLING
#define SHUTTER_BINDING 14
#define SHUTTER_SKY_BINDING 19
#include "shutter.glsl"
#endif

#ifdef GATHERED
// The place in a pixel that the sample shows, from its upper left corner.
layout(push_constant) uniform PlaceBlock { vec2 sample_place; };
#define SEEN (place - (vec2(1.0) - 2.0 * sample_place) / view.size)
#else
#define SEEN place
#endif

#ifdef MULTIPLE
layout(location = 0) smooth sample in vec2 place;
#else
layout(location = 0) in vec2 place;
#endif

#ifdef MEAN
layout(location = 0) out vec2 radiance_coverage;
#ifdef TRACED
layout(location = 1) out vec4 surface;
#endif
#else
layout(location = 0) out vec4 radiance_temperature_depth;
layout(location = 1) out uvec2 identity;
#ifdef TRACED
layout(location = 2) out vec4 surface;
#endif
#endif

void main() {
    vec3 ray = normalize(vec3((SEEN - view.clip_offset) / view.clip_scale, 1.0));
#ifdef ROLLING
    ray = sky_at_first(ray, share_of_ray(ray.xy / ray.z));
#endif
    float radiance = sky_radiance(around, ray);
#ifdef TRACED
    surface = vec4(0.0);
#endif
#ifdef MEAN
    radiance_coverage = vec2(radiance, 0.0);
#else
    radiance_temperature_depth = vec4(radiance, 0.0, 0.0, 0.0);
    identity = uvec2(0u, 0u);
#endif
}
