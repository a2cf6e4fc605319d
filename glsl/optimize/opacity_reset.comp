#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
#include "moments_store.glsl"
// opacity_reset — limit opacities to 0.01; set the moments of the opacity to 0.
// Work:    64 Gaussians per workgroup.
// Reads:   step
// Writes:  means.w and its moments [N]
// Mirror:  src/reference/densify.rs::opacity_reset

layout(local_size_x = 64) in;
READ1(0, StepUniforms, step);
INOUT(1, vec4, means);
MOMENTS(2, 3, means);

void main() {
    uint i = linear_group_id() * 64u + gl_LocalInvocationID.x;
    if (i < step.trained_count) {
        means[i].w = min(means[i].w, OPACITY_RESET_LOGIT);
        forget_moments(means, i, w);
    }
}
