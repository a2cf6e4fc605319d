#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
#include "gaussian.glsl"
#include "moments_store.glsl"
// mark_near — mark the Gaussians that fog the step's camera or a camera on the way to another one: in front of its near
//             plane, or so large that they contain the step's camera. The next densification prunes them.
// Work:    64 Gaussians per workgroup.
// Reads:   step, counters; means, scales [N]; variant lazy: moments of both, touched_at [N], missed
// Writes:  densify_stats [N]: (0, STAT_NEAR) for a marked Gaussian
// Math:    0 <= z <= near and the slopes of the centre within the limits of the Jacobian, which are the image and a
//          margin; or max(s) > FREE_SIZE |p|, in any direction. Views between the training cameras would show them. The
//          camera keeps its direction on the way, so each condition is linear in the share t of the way.
// Mirror:  src/reference/densify.rs::is_near

layout(local_size_x = 64) in;
READ1(0, StepUniforms, step);
FETCH4(1, means);
FETCH4(2, scales);
INOUT(3, vec2, densify_stats);
READ1(4, Counters, counters);
#ifdef LAZY
READ_MOMENTS(5, 7, means);
READ_MOMENTS(6, 8, scales);
FETCHU(9, touched_at);
READ(10, uvec4, missed);
#endif
#define plane4(name, e) fetch4(name, e)
#include "caught_up.glsl"
#ifdef LAZY
CAUGHT_UP(means, late_means)
CAUGHT_UP(scales, late_rest.x)
#endif

// The six conditions, each true if not negative.
float[6] conditions(StepUniforms u, vec3 p, float near) {
    return float[6](p.z, near - p.z, p.x - u.clamp_x_min * p.z, u.clamp_x_max * p.z - p.x, p.y - u.clamp_y_min * p.z,
        u.clamp_y_max * p.z - p.y);
}

// True if all conditions hold somewhere between a camera that sees the centre at `from` and one that sees it at `to`.
bool fogs(StepUniforms u, vec3 from, vec3 to, float near) {
    float first[6] = conditions(u, from, near), last[6] = conditions(u, to, near);
    float low = 0.0, high = 1.0;
    for (uint k = 0u; k < 6u; k++) {
        float zero = first[k] / (first[k] - last[k]);
        low = first[k] >= 0.0 ? low : last[k] >= 0.0 ? max(low, zero) : 2.0;
        high = last[k] >= 0.0 || first[k] < 0.0 ? high : min(high, zero);
    }
    return low <= high;
}

void main() {
    StepUniforms u = step;
    uint i = linear_group_id() * 64u + gl_LocalInvocationID.x;
    if (i >= u.trained_count || counters.failure != 0u) {
        return;
    }
#ifdef LAZY
    look_up_after(i);
#endif
    vec3 mean = value4(means, i).xyz, s = value4(scales, i).xyz, d = mean - u.free_centre;
    vec3 from = to_view(u, mean), to = vec3(dot(u.view_row0, d), dot(u.view_row1, d), dot(u.view_row2, d));
    bool engulfs = exp(max(s.x, max(s.y, s.z))) > FREE_SIZE * length(from);
    if (engulfs || fogs(u, from, from, u.near) || (u.free_near > 0.0 && fogs(u, from, to, u.free_near))) {
        densify_stats[i] = vec2(0.0, STAT_NEAR);
    }
}
