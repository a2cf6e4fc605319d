#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
#include "gaussian.glsl"
// gather — sum the gradient records of each splat, in the order of instances; update the densification statistic.
// Work:    64 splats per workgroup; variant group: a splat with many records is summed by all invocations, in a tree.
// Reads:   step, counters; tiles_touched, instance_offsets [V]; v_instances_a, _b, _c [I];
//          gaussian_from_splat [V]; variant labels: labels [N], layer_from_label
// Writes:  v_splats [V,3]: v_mean2d (px), v_conic xy..; v_conic z, v_log_opacity, v_colour rg; v_colour b
//          densify_stats [N] += (|scene v_mean2d| in NDC units, 1) of trained ones
// Math:    the statistic uses the scene layer only, without the label loss.
// Order:   fixed, bitwise reproducible; no atomics.
// Mirror:  src/reference/blend.rs::blend_backward, densify.rs::accumulate

layout(local_size_x = 64) in;
READ1(0, StepUniforms, step);
READ1(1, Counters, counters);
FETCHU(3, tiles_touched);
FETCHU(4, instance_offsets);
FETCH4(5, v_instances_a);
FETCH4(6, v_instances_b);
FETCH2(7, v_instances_c);
WRITE(9, vec4, v_splats);
FETCHU(8, gaussian_from_splat);
INOUT(10, vec2, densify_stats);
#ifdef LABELS
FETCHU(11, labels);
FETCHU(12, layer_from_label);
#endif

#include "records.glsl"

void main() {
    uint s = linear_group_id() * 64u + gl_LocalInvocationID.x;
    bool is_splat = s < counters.visible_count && counters.failure == 0u;
    Records r = Records(0u, 0u, 0u, 0u);
    if (is_splat) {
        r = records(s, fetchu(gaussian_from_splat, s));
    }
#ifdef GROUP
    Sums sums = sum_all(r);
#else
    Sums sums = sum_records(r, 0u, 1u);
#endif
    if (is_splat) {
        v_splats[3u * s] = sums.a;
        v_splats[3u * s + 1u] = sums.b;
        v_splats[3u * s + 2u] = vec4(sums.c.x, 0.0, 0.0, 0.0);
        note_gradient(r, sums);
    }
}
