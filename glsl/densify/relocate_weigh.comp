#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
#include "gaussian.glsl"
#include "densify_rules.glsl"
// relocate_weigh — the weight of each Gaussian for relocate_draw: its opacity; 0 for Gaussians to be removed.
// Work:    64 Gaussians per workgroup.
// Reads:   step; means [N]; densify_stats [N]
// Writes:  children_counts [N]: the weight in steps of 1 / RELOCATE_ONE, at least 1 step; exactly 1 outside the growth
//          box and for frozen Gaussians; counters.pruned_count
// Math:    3DGS-MCMC: an opacity below prune_opacity is dead, the others are drawn in proportion to their opacity.
//          Integer weights have an exact prefix sum.
// Mirror:  src/reference/relocate.rs::weights

layout(local_size_x = 64) in;
READ1(0, StepUniforms, step);
FETCH4(1, means);
READ(2, vec2, densify_stats);
WRITE(3, uint, children_counts);
INOUT1(4, Counters, counters);

void main() {
    StepUniforms u = step;
    uint i = linear_group_id() * 64u + gl_LocalInvocationID.x;
    if (i >= u.gaussian_count) {
        return;
    }
    if (i >= u.trained_count) {
        children_counts[i] = 1u;
        return;
    }
    vec4 mean = fetch4(means, i);
    float opacity = sigmoid(mean.w);
    bool dead = opacity < u.prune_opacity || densify_stats[i].y >= STAT_NEAR;
    float weight = grows_at(u, mean.xyz) ? floor(opacity * RELOCATE_ONE + 0.5) : 1.0;
    children_counts[i] = dead ? 0u : max(uint(weight), 1u);
    if (dead) {
        atomicAdd(counters.pruned_count, 1u);
    }
}
