#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
#include "gaussian.glsl"
#include "near.glsl"
// mark_near — mark the Gaussians that fog the step's camera or a camera on the way to another one: in front of its near
//             plane, or so large that they contain the step's camera. The next densification prunes them. Where
//             Gaussians may be late, project_visible marks them instead, before the step's update.
// Work:    64 Gaussians per workgroup.
// Reads:   step, counters; means, scales [N]
// Writes:  densify_stats [N]: (0, STAT_NEAR) for a marked Gaussian
// Math:    near.glsl
// Mirror:  src/reference/densify.rs::is_near

layout(local_size_x = 64) in;
READ1(0, StepUniforms, step);
FETCH4(1, means);
FETCH4(2, scales);
INOUT(3, vec2, densify_stats);
READ1(4, Counters, counters);

void main() {
    uint i = linear_group_id() * 64u + gl_LocalInvocationID.x;
    bool is_trained = i < step.trained_count && counters.failure == 0u;
    if (is_trained && is_near(step, fetch4(means, i).xyz, fetch4(scales, i).xyz)) {
        densify_stats[i] = vec2(0.0, STAT_NEAR);
    }
}
