#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
#include "densify_rules.glsl"
// densify_mark — decide how many Gaussians each one becomes: 0 pruned, 1 kept, 2 cloned or split. Frozen Gaussians are
//                kept.
// Work:    64 Gaussians per workgroup.
// Reads:   step; means, scales [N]; densify_stats [trained] (sum, count)
// Writes:  densify_actions [N]; children_counts [N]; counters.cloned_count, split_count, pruned_count (integer add)
// Math:    method of 3DGS; the size test for children uses their size after the split.
// Mirror:  src/reference/densify.rs::mark

layout(local_size_x = 64) in;
READ1(0, StepUniforms, step);
FETCH4(1, means);
FETCH4(2, scales);
READ(3, vec2, densify_stats);
WRITE(4, uint, children_counts);
INOUT1(5, Counters, counters);
WRITE(6, uint, densify_actions);

void main() {
    StepUniforms u = step;
    uint i = linear_group_id() * 64u + gl_LocalInvocationID.x;
    if (i >= u.gaussian_count) {
        return;
    }
    uint action = ACTION_KEEP;
    if (i < u.trained_count) {
        action = densify_action(u, fetch4(means, i), fetch4(scales, i).xyz, densify_stats[i]);
    }
    densify_actions[i] = action;
    children_counts[i] = children(action);
    if (action == ACTION_CLONE) {
        atomicAdd(counters.cloned_count, 1u);
    } else if (action == ACTION_SPLIT) {
        atomicAdd(counters.split_count, 1u);
    } else if (action == ACTION_PRUNE) {
        atomicAdd(counters.pruned_count, 1u);
    }
}
