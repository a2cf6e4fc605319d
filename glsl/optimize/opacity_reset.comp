#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
// opacity_reset — limit opacities to 0.01; set the moments of the opacity to 0.
// Work:    64 Gaussians per workgroup.
// Reads:   step
// Writes:  means.w, m_means.w, u_means.w [N]
// Mirror:  src/reference/densify.rs::opacity_reset

layout(local_size_x = 64) in;
READ1(0, StepUniforms, step);
INOUT(1, vec4, means);
INOUT(2, vec4, m_means);
INOUT(3, vec4, u_means);

void main() {
    uint i = linear_group_id() * 64u + gl_LocalInvocationID.x;
    if (i < step.trained_count) {
        means[i].w = min(means[i].w, OPACITY_RESET_LOGIT);
        m_means[i].w = 0.0;
        u_means[i].w = 0.0;
    }
}
