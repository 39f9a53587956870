#version 450
// Response of nodes to given targets: many steps of the thermal step's transition, without a load. Each invocation has
// four nodes. Targets and temperatures are ordered by step. Variants: RESTART: restart rule; otherwise merge rule.

#if !defined(RESTART) && !defined(MERGE)
#define MERGE
#endif

#include "types.glsl"
#ifndef SHAPED
#include "transition.glsl"
#endif

layout(local_size_x = 64) in;

layout(set = 0, binding = 0) readonly buffer ResponseStepsBlock { Steps steps; };
layout(set = 0, binding = 1) readonly buffer ResponseTargetsBlock { vec4 commanded[]; };
layout(set = 0, binding = 3) readonly buffer MaterialsBlock { Material materials[]; };
layout(set = 0, binding = 8) buffer TargetBlock { vec4 target[]; };
layout(set = 0, binding = 9) buffer SpanBlock { vec4 span[]; };
layout(set = 0, binding = 10) buffer ElapsedBlock { ivec4 elapsed[]; };
layout(set = 0, binding = 11) buffer ResponseTemperaturesBlock { vec4 temperature[]; };
#ifdef SHAPED
layout(set = 0, binding = 12) readonly buffer ShapesBlock { vec2 shapes[]; };
#include "shaped_transition.glsl"
#endif

void main() {
    uint group = gl_GlobalInvocationID.x;
    Material material = materials[0];
#ifdef SHAPED
    ShapedBranches both = shaped_branches(material, 1.0);
#endif
    vec4 old_target = target[group];
    vec4 old_span = span[group];
    ivec4 old_elapsed = elapsed[group];
    for (uint i = 0u; i < steps.count; i++) {
        uint at = i * steps.groups + group;
        vec4 next = commanded[at];
#ifdef SHAPED
        ShapedNode x = transition_step(old_target.x, old_span.x, old_elapsed.x, next.x, both);
        ShapedNode y = transition_step(old_target.y, old_span.y, old_elapsed.y, next.y, both);
        ShapedNode z = transition_step(old_target.z, old_span.z, old_elapsed.z, next.z, both);
        ShapedNode w = transition_step(old_target.w, old_span.w, old_elapsed.w, next.w, both);
        old_target = vec4(x.target, y.target, z.target, w.target);
        old_span = vec4(x.gap, y.gap, z.gap, w.gap);
        old_elapsed = ivec4(x.elapsed, y.elapsed, z.elapsed, w.elapsed);
        temperature[at] = vec4(x.temperature, y.temperature, z.temperature, w.temperature);
#else
        TransitionState state = TransitionState(old_target, old_span, old_elapsed);
#ifdef MERGE
        state = retarget_merge(state, next, material);
#endif
#ifdef RESTART
        state = retarget_restart(state, next, material);
#endif
        state = advance(state, 1.0, material);
        old_target = state.target;
        old_span = state.span;
        old_elapsed = state.elapsed;
        temperature[at] = transition_temperature(state, material);
#endif
    }
    target[group] = old_target;
    span[group] = old_span;
    elapsed[group] = old_elapsed;
}
