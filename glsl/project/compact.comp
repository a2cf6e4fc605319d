#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
// compact — list the visible Gaussians, in the order of the model.
// Work:    64 Gaussians per workgroup.
// Reads:   step, counters; depth_keys [N]; visible_offsets [N]
// Writes:  keys_out [V] depth bits; values_out [V] Gaussian index
// Mirror:  src/reference/scan.rs::compact

layout(local_size_x = 64) in;
READ1(0, StepUniforms, step);
FETCHU(1, depth_keys);
FETCHU(2, visible_offsets);
WRITE(3, uint, keys_out);
WRITE(4, uint, values_out);
READ1(5, Counters, counters);

void main() {
    uint i = linear_group_id() * 64u + gl_LocalInvocationID.x;
    // After a failure, the scan counts nothing, and the offsets belong to an earlier step.
    if (i >= step.gaussian_count || counters.failure != 0u) {
        return;
    }
    uint key = fetchu(depth_keys, i);
    if (key != KEY_INVISIBLE) {
        uint to = fetchu(visible_offsets, i);
        keys_out[to] = key;
        values_out[to] = i;
    }
}
