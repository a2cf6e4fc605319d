#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
// expose — apply the photo's exposure to the picture.
// Work:    64 pixels per workgroup.
// Reads:   step; step_rows [ROW], the first row of the photo; shared_parameters [S]
// Writes:  image [P] rgb, in place
// Math:    exposure.glsl. Only the photo loss reads it: the backward pass needs only the transmittance.
// Mirror:  src/reference/exposure.rs::exposed

layout(constant_id = 17) const uint ROW = 0;
layout(local_size_x = 64) in;
READ1(0, StepUniforms, step);
READ(1, uint, step_rows);
READ(2, vec4, shared_parameters);
INOUT(3, vec4, image);

#include "exposure.glsl"

void main() {
    uint p = linear_group_id() * 64u + gl_LocalInvocationID.x;
    if (p < step.width * step.height) {
        image[p].rgb = colours(exposure(ROW)) * image[p].rgb;
    }
}
