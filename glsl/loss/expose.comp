#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
// expose — multiply the picture by the exposure of its photo.
// Work:    64 pixels per workgroup.
// Reads:   step; step_rows [ROW], the row of the photo; shared_parameters [S]: ln of the gains of r, g, b
// Writes:  image [P] rgb, in place
// Math:    c' = exp(g) c, by channel. Nothing but the photo loss reads it: the backward walk needs the transmittance only.
// Mirror:  src/verify/reference/exposure.rs::exposed

layout(constant_id = 17) const uint ROW = 0;
layout(local_size_x = 64) in;
READ1(0, StepUniforms, step);
READ(1, uint, step_rows);
READ(2, vec4, shared_parameters);
INOUT(3, vec4, image);

void main() {
    uint p = linear_group_id() * 64u + gl_LocalInvocationID.x;
    if (p < step.width * step.height) {
        image[p].rgb *= exp(shared_parameters[step_rows[ROW]].rgb);
    }
}
