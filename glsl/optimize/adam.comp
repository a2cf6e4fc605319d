#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
#include "moments_store.glsl"
// adam — one Adam update of one attribute of all trained Gaussians. An invisible Gaussian has gradient 0; with
//        SEEN_ONLY, it stays unchanged. SHARED: one update of the step's shared rows with a rate above 0; all other
//        rows stay unchanged, and the number of updates of each row corrects its moments. HALF: the moments are packed.
// Work:    one vec4 of one Gaussian per invocation; STRIDE vec4 per Gaussian. SHARED: one row of the step.
// Reads:   step, counters; splat_from_gaussian [N]; gradients [V,STRIDE]; parameters_in and their moments
//          [N,STRIDE]. SHARED: counters; step_rows, step_rates, gradients, weights and the rest [S]
// Writes:  parameters and their moments [N,STRIDE], the same buffers. SHARED: also weights [S]
// Math:    Kingma and Ba; beta 0.9 / 0.999, epsilon 1e-15, no weight decay; rates by RATE. SHARED: 1 - beta^t is
//          kept as the moment of a gradient of 1, without a power or a count of updates.
// Mirror:  src/reference/adam.rs::adam, adam.rs::adam_value, moments.rs::pack

layout(local_size_x = 64) in;
#ifdef SHARED
layout(constant_id = 14) const uint ROWS = 65536; // elements of step_rows
READ(0, uint, step_rows);
READ(2, vec4, step_rates);
INOUT(10, vec2, weights);
#else
layout(constant_id = 14) const uint STRIDE = 1;
layout(constant_id = 15) const uint RATE = 0; // 0 means, 1 scales, 2 quats, 3 sh0, 4 higher bands
layout(constant_id = 16) const uint SEEN_ONLY = 0;
READ1(0, StepUniforms, step);
FETCHU(2, splat_from_gaussian);
#endif
READ1(1, Counters, counters);
FETCH4(3, gradients);
// Two bindings for one buffer: texel reads where they are fast, storage writes. An invocation reads only its own
// elements, before it writes them.
FETCH4(4, parameters_in);
READ_MOMENTS(5, 6, parameters_in);
WRITE(7, vec4, parameters);
WRITE_MOMENTS(8, 9, parameters);
#define plane4(name, e) fetch4(name, e)

void main() {
#ifdef SHARED
    uint i = linear_group_id() * 64u + gl_LocalInvocationID.x;
    uint e = i < ROWS ? step_rows[i] : NO_ROW;
    if (e == NO_ROW || counters.failure != 0u) {
        return;
    }
    vec4 rate = step_rates[i];
    if (rate == vec4(0.0)) {
        return;
    }
    vec4 g = fetch4(gradients, e);
    vec2 beta = vec2(ADAM_BETA1, ADAM_BETA2);
    vec2 weight = beta * weights[e] + (1.0 - beta);
    weights[e] = weight;
    float correction1 = 1.0 / weight.x, correction2 = 1.0 / weight.y;
#else
    StepUniforms u = step;
    uint e = linear_group_id() * 64u + gl_LocalInvocationID.x;
    uint i = e / STRIDE;
    if (i >= u.trained_count || counters.failure != 0u) {
        return;
    }
    uint s = fetchu(splat_from_gaussian, i);
    if (SEEN_ONLY != 0u && s == NO_SPLAT) {
        return;
    }
    vec4 g = fetch4(gradients, s == NO_SPLAT ? 0u : (s & SPLAT_MASK) * STRIDE + (e - i * STRIDE));
    g = s == NO_SPLAT ? vec4(0.0) : g;
    vec4 rate = RATE == 0u ? u.rate_means
        : RATE == 3u ? vec4(vec3(u.rate_sh0), u.rate_sh_rest)
        : vec4(RATE == 1u ? u.rate_scales : RATE == 2u ? u.rate_quats : u.rate_sh_rest);
    float correction1 = u.adam_correction1, correction2 = u.adam_correction2;
#endif
    vec4 m, v;
    load_moments(parameters_in, e, m, v);
    m = ADAM_BETA1 * m + (1.0 - ADAM_BETA1) * g;
    v = ADAM_BETA2 * v + (1.0 - ADAM_BETA2) * g * g;
    vec4 update = rate * (m * correction1) / (sqrt(v * correction2) + ADAM_EPSILON);
    parameters[e] = fetch4(parameters_in, e) - update;
    store_moments(parameters, e, m, v, u.seed, RATE < 4u ? RATE : 3u + (STRIDE + 1u) / 2u);
}
