#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
#include "gaussian.glsl"
// gather — sum the gradient records of each splat, in the order of instances; update the densification statistic.
// Work:    64 splats per workgroup.
// Reads:   step, counters, failure; tiles_touched, instance_offsets [V]; v_instances_a, _b, _c [I];
//          gaussian_from_splat [V]; variant labels: labels [N], layer_from_label
// Writes:  v_splats [V,3]: v_mean2d (px), v_conic xy..; v_conic z, v_log_opacity, v_colour rg; v_colour b
//          densify_stats [N] += (|scene v_mean2d| in NDC units, 1) of trained ones
// Math:    the statistic uses the scene layer only, without the label loss.
// Order:   fixed, bitwise reproducible; no atomics.
// Mirror:  src/reference/blend.rs::blend_backward, densify.rs::accumulate

layout(local_size_x = 64) in;
READ1(0, StepUniforms, step);
READ1(1, Counters, counters);
READ1(2, uint, failure);
FETCHU(3, tiles_touched);
FETCHU(4, instance_offsets);
FETCH4(5, v_instances_a);
FETCH4(6, v_instances_b);
FETCH4(7, v_instances_c);
WRITE(9, vec4, v_splats);
FETCHU(8, gaussian_from_splat);
INOUT(10, vec2, densify_stats);
#ifdef LABELS
FETCHU(11, labels);
FETCHU(12, layer_from_label);
#endif

void main() {
    uint s = linear_group_id() * 64u + gl_LocalInvocationID.x;
    if (s >= counters.visible_count || failure != 0u) {
        return;
    }
    uint stamp = step.stamp;
    uint total = fetchu(tiles_touched, s), first = fetchu(instance_offsets, s);
    uint scene = total;
    uint gaussian = fetchu(gaussian_from_splat, s);
#ifdef LABELS
    scene = fetchu(layer_from_label, fetchu(labels, gaussian)) != 0u ? total / 2u : total;
#endif
    vec4 a = vec4(0.0), b = vec4(0.0);
    float c = 0.0;
    vec2 scene_mean = vec2(0.0);
    for (uint k = 0u; k < total; k++) {
        uint at = first + k;
        vec4 ra = fetch4(v_instances_a, at), rb = fetch4(v_instances_b, at), rc = fetch4(v_instances_c, at);
        bool current = floatBitsToUint(rc.y) == stamp;
        a += current ? ra : vec4(0.0);
        b += current ? rb : vec4(0.0);
        c += current ? rc.x : 0.0;
        vec2 tile_mean = step.sum_absolute != 0u ? abs(ra.xy) : ra.xy;
        scene_mean += current && k < scene ? tile_mean : vec2(0.0);
    }
    v_splats[3u * s] = a;
    v_splats[3u * s + 1u] = b;
    v_splats[3u * s + 2u] = vec4(c, 0.0, 0.0, 0.0);
    if (total > 0u && gaussian < step.trained_count) {
        float size = length(scene_mean * vec2(0.5 * float(step.width), 0.5 * float(step.height)));
        // As in project_backward, which drops the gradients of such a splat: an infinity would stay in the sum.
        if (finite(size) && size < GRADIENT_MAX) {
            densify_stats[gaussian] += vec2(size, 1.0);
        }
    }
}
