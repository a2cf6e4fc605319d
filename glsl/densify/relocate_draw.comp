#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
#include "densify_rules.glsl"
#include "random.glsl"
// relocate_draw — draw u.draws Gaussians by their weights, and decide how many copies each one becomes.
// Work:    64 Gaussians per workgroup.
// Reads:   step; means [N]; child_offsets [N]: sums of the weights before each Gaussian
// Writes:  densify_actions [N]; children_counts [N]: from weights to numbers of copies; counters.cloned_count
// Math:    systematic sampling: even steps through the sum of the weights, from a random start. A stack has at most
//          RELOCATE_MOST copies, including the Gaussian itself (3DGS-MCMC). Draws outside the growth box and of frozen
//          Gaussians are ignored.
// Mirror:  src/reference/relocate.rs::copies

layout(local_size_x = 64) in;
READ1(0, StepUniforms, step);
READ(1, uint, child_offsets);
INOUT(2, uint, children_counts);
INOUT1(3, Counters, counters);
WRITE(4, uint, densify_actions);
FETCH4(5, means);

void main() {
    StepUniforms u = step;
    uint i = linear_group_id() * 64u + gl_LocalInvocationID.x;
    if (i >= u.gaussian_count) {
        return;
    }
    uint weight = children_counts[i], before = child_offsets[i];
    float phase = uniform_draw(u.seed, NO_SPLAT, 0u);
    // The end of one Gaussian and the start of the next are rounded in the same way, so that no draw counts twice.
    precise float from = float(before) * u.draws_per_weight + phase;
    precise float to = float(before + weight) * u.draws_per_weight + phase;
    uint drawn = min(uint(floor(to)), u.draws) - min(uint(floor(from)), u.draws);
    drawn = i < u.trained_count && grows_at(u, fetch4(means, i).xyz) ? drawn : 0u;
    uint copies = weight == 0u ? 0u : 1u + min(drawn, RELOCATE_MOST - 1u);
    children_counts[i] = copies;
    densify_actions[i] = copies == 0u ? ACTION_PRUNE : copies == 1u ? ACTION_KEEP : ACTION_STACK + copies;
    if (copies > 1u) {
        atomicAdd(counters.cloned_count, copies - 1u);
    }
}
