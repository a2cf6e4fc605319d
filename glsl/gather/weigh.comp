#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
// weigh — add each splat's blending weight in the view, summed over all pixels, to its Gaussian's weight.
// Work:    64 splats per workgroup.
// Reads:   counters; tiles_touched, instance_offsets [V]; gaussian_from_splat [V]; v_instances_b, _c [I] for a
//          gradient of 1 of the red of every pixel; step (its stamp)
// Writes:  densify_stats [N].x += weight, px
// Math:    the picture is linear in the colours of the splats, and the factors are the blending weights: the gradient
//          of the sum of all pixels with respect to a splat's red is the sum of its weights.
// Order:   fixed, bitwise reproducible; no atomics.
// Mirror:  src/reference/lift.rs::vote

layout(local_size_x = 64) in;
READ1(0, StepUniforms, step);
READ1(1, Counters, counters);
FETCHU(3, tiles_touched);
FETCHU(4, instance_offsets);
FETCHU(5, gaussian_from_splat);
FETCH4(6, v_instances_b);
FETCH2(7, v_instances_c);
INOUT(8, vec2, densify_stats);

void main() {
    uint s = linear_group_id() * 64u + gl_LocalInvocationID.x;
    if (s >= counters.visible_count || counters.failure != 0u) {
        return;
    }
    uint total = fetchu(tiles_touched, s), first = fetchu(instance_offsets, s);
    float weight = 0.0;
    for (uint at = first; at < first + total; at++) {
        bool current = floatBitsToUint(fetch2(v_instances_c, at).y) == step.stamp;
        weight += current ? fetch4(v_instances_b, at).z : 0.0;
    }
    uint i = fetchu(gaussian_from_splat, s);
    if (i < step.trained_count) {
        densify_stats[i].x += weight;
    }
}
