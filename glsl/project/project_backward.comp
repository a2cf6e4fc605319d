#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
#include "gaussian.glsl"
#include "projection.glsl"
#include "sh.glsl"
#include "strategy_moves.glsl"
// project_backward — carry the gradients of each splat back to the parameters of its Gaussian.
// Work:    64 splats per workgroup.
// Reads:   step, counters; gaussian_from_splat [V]; splat_from_gaussian, means, scales, quats, sh0..sh3 [N];
//          v_splats [V,3]
// Writes:  v_means [V] (xyz world, w opacity logit), v_scales [V] (ln), v_quats [V], v_sh0 [V], v_sh1 [V,2], v_sh2
//          [V,4], v_sh3 [V,5]; counters.nonfinite_* (integer atomics): Gaussians with a nonfinite gradient, which
//          becomes 0
// Math:    dSigma = -Q dQ Q through the inverse; dM = 2 G M; Jacobian, view direction and mean2d paths reach the mean;
//          a clamped x/z or y/z has gradient 0; so does a colour clamped at 0;
//          variant antialiased: the opacity reaches M through the coverage. MODES: loss terms (strategy_moves.glsl).
// Mirror:  src/reference/project.rs::project_backward, relocate.rs::regularised

layout(constant_id = 11) const uint SH_DEGREE = 3;
layout(constant_id = 20) const uint MODES = 0; // bits UPDATE_ of constants.glsl
layout(local_size_x = 64) in;
READ1(0, StepUniforms, step);
FETCHU(2, gaussian_from_splat);
FETCH4(3, means);
FETCH4(4, scales);
FETCH4(5, quats);
FETCH4(6, sh0);
FETCH4(7, sh1);
FETCH4(8, sh2);
FETCH4(9, sh3);
FETCH4(10, v_splats);
WRITE(11, vec4, v_means);
WRITE(12, vec4, v_scales);
WRITE(13, vec4, v_quats);
WRITE(14, vec4, v_sh0);
WRITE(15, vec4, v_sh1);
WRITE(16, vec4, v_sh2);
WRITE(17, vec4, v_sh3);
INOUT1(18, Counters, counters);
FETCHU(19, splat_from_gaussian);

#include "sh_colour.glsl"
#include "sh_backward.glsl"
#include "sh_store.glsl"
#include "splat_backward.glsl"

void main() {
    StepUniforms u = step;
    uint s = linear_group_id() * 64u + gl_LocalInvocationID.x;
    if (s >= counters.visible_count || counters.failure != 0u) {
        return;
    }
    uint i = fetchu(gaussian_from_splat, s);
    vec4 a = fetch4(v_splats, 3u * s), b = fetch4(v_splats, 3u * s + 1u);
    float blue = fetch4(v_splats, 3u * s + 2u).x;
    vec4 mean = fetch4(means, i);
    vec3 log_scale = fetch4(scales, i).xyz;
    GaussianGradient v = project_splat_backward(u, i, mean, log_scale, fetch4(quats, i), a, b, blue,
        fetchu(splat_from_gaussian, i) >> SPLAT_BITS);
    if ((MODES & UPDATE_REGULARISES) != 0u) {
        regularise(u, mean.w, log_scale, v.logit, v.log_scale);
    }
    v_means[s] = vec4(v.mean, v.logit);
    v_scales[s] = vec4(v.log_scale, 0.0);
    v_quats[s] = v.quat;
    float inv_distance, basis[15];
    sh_basis(direction_of(mean.xyz - u.camera_centre, inv_distance), SH_DEGREE, basis);
    store_sh_gradient(s, basis, v.colour);
}
