#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
// adam — one Adam update of one attribute of all Gaussians; a Gaussian that is not visible has gradient 0, or with
//        SEEN_ONLY stays as it is.
// Work:    one vec4 of one Gaussian an invocation; STRIDE vec4 a Gaussian.
// Reads:   step, failure; splat_from_gaussian [N]; gradients [V,STRIDE]; parameters_in, first_moments_in,
//          second_moments_in [N,STRIDE]
// Writes:  parameters, first_moments, second_moments [N,STRIDE], the same buffers
// Math:    Kingma and Ba; beta 0.9 / 0.999, epsilon 1e-15, no weight decay; rates by RATE.
// Mirror:  src/verify/reference/adam.rs::adam

layout(constant_id = 14) const uint STRIDE = 1;
layout(constant_id = 15) const uint RATE = 0; // 0 means, 1 scales, 2 quats, 3 sh0, 4 higher bands
layout(constant_id = 16) const uint SEEN_ONLY = 0;
layout(local_size_x = 64) in;
READ1(0, StepUniforms, step);
READ1(1, uint, failure);
FETCHU(2, splat_from_gaussian);
FETCH4(3, gradients);
// One buffer, two bindings: read as texels where that is fast, written as storage. An invocation reads its own elements
// only, before it writes them.
FETCH4(4, parameters_in);
FETCH4(5, first_moments_in);
FETCH4(6, second_moments_in);
WRITE(7, vec4, parameters);
WRITE(8, vec4, first_moments);
WRITE(9, vec4, second_moments);

void main() {
    StepUniforms u = step;
    uint e = linear_group_id() * 64u + gl_LocalInvocationID.x;
    uint i = e / STRIDE;
    if (i >= u.gaussian_count || failure != 0u) {
        return;
    }
    uint s = fetchu(splat_from_gaussian, i);
    if (SEEN_ONLY != 0u && s == NO_SPLAT) {
        return;
    }
    vec4 g = fetch4(gradients, s == NO_SPLAT ? 0u : s * STRIDE + (e - i * STRIDE));
    g = s == NO_SPLAT ? vec4(0.0) : g;
    vec4 rate = RATE == 0u ? u.rate_means
        : vec4(RATE == 1u ? u.rate_scales : RATE == 2u ? u.rate_quats : RATE == 3u ? u.rate_sh0 : u.rate_sh_rest);
    vec4 m = ADAM_BETA1 * fetch4(first_moments_in, e) + (1.0 - ADAM_BETA1) * g;
    vec4 v = ADAM_BETA2 * fetch4(second_moments_in, e) + (1.0 - ADAM_BETA2) * g * g;
    vec4 update = rate * (m * u.adam_correction1) / (sqrt(v * u.adam_correction2) + ADAM_EPSILON);
    parameters[e] = fetch4(parameters_in, e) - update;
    first_moments[e] = m;
    second_moments[e] = v;
}
