#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
#include "gaussian.glsl"
#include "strategy_moves.glsl"
// move_all — what strategies do to all Gaussians after an update: random moves, and a smallest size.
// Work:    64 Gaussians per workgroup.
// Reads:   step, counters; means_in, scales_in, quats [N]
// Writes:  means.xyz and scales [N], the same buffers: scales.w is the smallest size, the least over all views so far
//          that see the centre; 0 if there is none
// Mirror:  src/reference/relocate.rs::explored, smooth.rs::smooth

layout(constant_id = 20) const uint MODES = 12; // bits UPDATE_ of constants.glsl
layout(local_size_x = 64) in;
READ1(0, StepUniforms, step);
READ1(1, Counters, counters);
FETCH4(2, means_in);
FETCH4(3, scales_in);
FETCH4(4, quats);
WRITE(5, vec4, means);
WRITE(6, vec4, scales);

void main() {
    StepUniforms u = step;
    uint i = linear_group_id() * 64u + gl_LocalInvocationID.x;
    if (i >= u.trained_count || counters.failure != 0u) {
        return;
    }
    vec4 mean = fetch4(means_in, i), scale = fetch4(scales_in, i);
    if ((MODES & UPDATE_EXPLORES) != 0u) {
        mean.xyz += random_move(u, i, mean.w, scale.xyz, fetch4(quats, i));
        means[i] = mean;
    }
    if ((MODES & UPDATE_SMOOTHS) != 0u) {
        scales[i] = limited(vec4(scale.xyz, smallest_size(u, mean.xyz, scale.w)));
    }
}
