#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
#include "gaussian.glsl"
// mark_near — mark the Gaussians that fog the camera of the step: before its near plane, or so large that they engulf
//             it. The next densification prunes them.
// Work:    64 Gaussians per workgroup.
// Reads:   step, failure; means, scales [N]
// Writes:  densify_stats [N]: (0, STAT_NEAR) for a marked Gaussian
// Math:    0 < z <= near and the slopes of the centre within the limits of the Jacobian, which are the image and a
//          margin; or max(s) > FREE_SIZE |p|, whatever the direction. Views between the training cameras would show them.
// Mirror:  src/verify/reference/densify.rs::is_near

layout(local_size_x = 64) in;
READ1(0, StepUniforms, step);
FETCH4(1, means);
FETCH4(2, scales);
INOUT(3, vec2, densify_stats);
READ1(4, uint, failure);

void main() {
    StepUniforms u = step;
    uint i = linear_group_id() * 64u + gl_LocalInvocationID.x;
    if (i >= u.gaussian_count || failure != 0u) {
        return;
    }
    vec3 view = to_view(u, fetch4(means, i).xyz);
    vec2 slope = view.xy / view.z;
    bool inside = all(greaterThanEqual(slope, vec2(u.clamp_x_min, u.clamp_y_min)))
        && all(lessThanEqual(slope, vec2(u.clamp_x_max, u.clamp_y_max)));
    vec3 s = fetch4(scales, i).xyz;
    float sigma = exp(max(s.x, max(s.y, s.z)));
    bool is_near = view.z > 0.0 && view.z <= u.near && inside;
    if (is_near || sigma > FREE_SIZE * length(view)) {
        densify_stats[i] = vec2(0.0, STAT_NEAR);
    }
}
