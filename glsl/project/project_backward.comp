#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
#include "gaussian.glsl"
#include "projection.glsl"
#include "sh.glsl"
// project_backward — carry the gradients of each splat back to the parameters of its Gaussian.
// Work:    64 splats per workgroup.
// Reads:   step, counters; gaussian_from_splat [V]; means, scales, quats, sh0..sh3 [N]; v_splats [V,3]
// Writes:  v_means [V] (xyz world, w opacity logit), v_scales [V] (ln), v_quats [V], v_sh0 [V], v_sh1 [V,2], v_sh2
//          [V,4], v_sh3 [V,5]; counters.nonfinite_* (integer atomics): Gaussians with a nonfinite gradient, which
//          becomes 0
// Math:    dSigma = -Q dQ Q through the inverse; dM = 2 G M; Jacobian, view direction and mean2d paths reach the mean;
//          a clamped x/z or y/z has gradient 0; so does a colour clamped at 0;
//          variant antialiased: the opacity reaches M through the coverage.
// Mirror:  src/reference/project.rs::project_backward

layout(constant_id = 11) const uint SH_DEGREE = 3;
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

#include "sh_colour.glsl"
#include "sh_backward.glsl"
#include "sh_store.glsl"

void main() {
    StepUniforms u = step;
    uint s = linear_group_id() * 64u + gl_LocalInvocationID.x;
    if (s >= counters.visible_count || counters.failure != 0u) {
        return;
    }
    uint i = fetchu(gaussian_from_splat, s);
    vec4 mean = fetch4(means, i), quat = fetch4(quats, i);
    Projection p = project_gaussian(u, mean.xyz, fetch4(scales, i).xyz, quat);
    vec4 a = fetch4(v_splats, 3u * s), b = fetch4(v_splats, 3u * s + 1u);
    float blue = fetch4(v_splats, 3u * s + 2u).x;
    bool sane = finite(dot(abs(a), vec4(1.0)) + dot(abs(b), vec4(1.0)) + abs(blue));
#include "splat_backward.glsl"
    if (!sane) {
        atomicAdd(counters.nonfinite_count, 1u);
        atomicMin(counters.nonfinite_first, i);
    }
    v_means[s] = sane ? vec4(v_mean, v_logit) : vec4(0.0);
    v_scales[s] = sane ? vec4(v_log_scale, 0.0) : vec4(0.0);
    v_quats[s] = sane ? v_quat : vec4(0.0);
    store_sh_gradient(s, basis, sane ? v_colour : vec3(0.0));
}
