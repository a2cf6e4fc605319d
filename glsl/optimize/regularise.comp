#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
#include "gaussian.glsl"
// regularise — add the gradients of mean opacity and mean standard deviation to the view's gradients.
// Work:    64 splats per workgroup.
// Reads:   step, counters; gaussian_from_splat [V]; means, scales [N]
// Writes:  v_means.w, v_scales.xyz [V], added
// Math:    3DGS-MCMC: L += opacity_weight sum o + scale_weight sum (s_x + s_y + s_z), over the visible Gaussians.
// Mirror:  src/reference/relocate.rs::regularised

layout(local_size_x = 64) in;
READ1(0, StepUniforms, step);
READ1(2, Counters, counters);
FETCHU(3, gaussian_from_splat);
FETCH4(4, means);
FETCH4(5, scales);
INOUT(6, vec4, v_means);
INOUT(7, vec4, v_scales);

void main() {
    StepUniforms u = step;
    uint s = linear_group_id() * 64u + gl_LocalInvocationID.x;
    if (s >= counters.visible_count || counters.failure != 0u) {
        return;
    }
    uint i = fetchu(gaussian_from_splat, s);
    float opacity = sigmoid(fetch4(means, i).w);
    v_means[s].w += u.opacity_weight * opacity * (1.0 - opacity);
    v_scales[s].xyz += u.scale_weight * exp(fetch4(scales, i).xyz);
}
