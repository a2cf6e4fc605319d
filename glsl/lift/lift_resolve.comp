#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
// lift_resolve — give each Gaussian the label with its highest key of this step.
// Work:    64 Gaussians per workgroup.
// Reads:   step, counters; label_keys [N]
// Writes:  labels [N] of Gaussians with a key; label_keys [N] = 0
// Math:    LabelGS eq. 6 and 7; without the filter, the larger weight wins, then the larger label.
// Mirror:  src/reference/lift.rs::lift

layout(local_size_x = 64) in;
READ1(0, StepUniforms, step);
READ1(1, Counters, counters);
INOUT(2, uint, label_keys);
WRITE(3, uint, labels);

void main() {
    uint i = linear_group_id() * 64u + gl_LocalInvocationID.x;
    if (i >= step.gaussian_count) {
        return;
    }
    uint key = label_keys[i];
    if (key != 0u) {
        label_keys[i] = 0u;
        if (counters.failure == 0u && i < step.trained_count) {
            labels[i] = key & 0xffffu;
        }
    }
}
