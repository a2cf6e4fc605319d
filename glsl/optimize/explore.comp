#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
#include "gaussian.glsl"
#include "random.glsl"
// explore — move Gaussians at random within their own shape; fainter Gaussians move farther.
// Work:    64 Gaussians per workgroup.
// Reads:   step, counters; means_in, scales, quats [N]
// Writes:  means.xyz [N], the same buffer
// Math:    3DGS-MCMC: x += noise sigmoid(-NOISE_STEEP (o - NOISE_OPACITY)) Sigma xi, xi standard normal.
// Mirror:  src/reference/relocate.rs::explored

layout(local_size_x = 64) in;
READ1(0, StepUniforms, step);
READ1(1, Counters, counters);
FETCH4(2, means_in);
FETCH4(3, scales);
FETCH4(4, quats);
WRITE(5, vec4, means);

void main() {
    StepUniforms u = step;
    uint i = linear_group_id() * 64u + gl_LocalInvocationID.x;
    if (i >= u.trained_count || counters.failure != 0u) {
        return;
    }
    vec4 mean = fetch4(means_in, i);
    float inv_norm;
    mat3 rotation = rotation_from_quat(unit_quat(fetch4(quats, i), inv_norm));
    vec3 draw = vec3(normal_draw(u.seed, i, 0u), normal_draw(u.seed, i, 1u), normal_draw(u.seed, i, 2u));
    vec3 variance = exp(2.0 * fetch4(scales, i).xyz);
    float gate = u.noise * sigmoid(-NOISE_STEEP * (sigmoid(mean.w) - NOISE_OPACITY));
    mean.xyz += gate * (rotation * (variance * (draw * rotation)));
    means[i] = mean;
}
