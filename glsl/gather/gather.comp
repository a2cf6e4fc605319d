#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
#include "gaussian.glsl"
// gather — sum the gradient records of each splat, in the order of instances; update the densification statistic.
// Work:    64 splats per workgroup; variant group: a splat with many records by all of them, in a tree.
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

#ifdef GROUP
const uint WALKERS = 64u; // invocations of a workgroup
shared uint large_count;  // splats with more records than that,
shared uint large[WALKERS];
shared vec4 shared_a[WALKERS / 2u], shared_b[WALKERS / 2u]; // and sums of one of them
shared vec3 shared_c[WALKERS / 2u];
#endif

// Records of a splat; those of the scene layer are first.
struct Records {
    uint first, total, scene, gaussian;
};

struct Sums {
    vec4 a, b;
    vec3 c; // blue; v_mean2d of the scene layer for the statistic
};

Records records(uint s) {
    Records r;
    r.total = fetchu(tiles_touched, s);
    r.first = fetchu(instance_offsets, s);
    r.scene = r.total;
    r.gaussian = fetchu(gaussian_from_splat, s);
#ifdef LABELS
    r.scene = fetchu(layer_from_label, fetchu(labels, r.gaussian)) != 0u ? r.total / 2u : r.total;
#endif
    return r;
}

// Adds up every stride-th record.
Sums sum_records(Records r, uint from, uint stride) {
    uint stamp = step.stamp;
    Sums sums = Sums(vec4(0.0), vec4(0.0), vec3(0.0));
    for (uint k = from; k < r.total; k += stride) {
        uint at = r.first + k;
        vec4 ra = fetch4(v_instances_a, at), rb = fetch4(v_instances_b, at), rc = fetch4(v_instances_c, at);
        bool current = floatBitsToUint(rc.y) == stamp;
        sums.a += current ? ra : vec4(0.0);
        sums.b += current ? rb : vec4(0.0);
        sums.c.x += current ? rc.x : 0.0;
        vec2 tile_mean = step.sum_absolute != 0u ? abs(ra.xy) : ra.xy;
        sums.c.yz += current && k < r.scene ? tile_mean : vec2(0.0);
    }
    return sums;
}

void finish(uint s, Records r, Sums sums) {
    v_splats[3u * s] = sums.a;
    v_splats[3u * s + 1u] = sums.b;
    v_splats[3u * s + 2u] = vec4(sums.c.x, 0.0, 0.0, 0.0);
    if (r.total > 0u && r.gaussian < step.trained_count) {
        float size = length(sums.c.yz * vec2(0.5 * float(step.width), 0.5 * float(step.height)));
        // As in project_backward, which drops the gradients of such a splat: an infinity would stay in the sum.
        if (finite(size) && size < GRADIENT_MAX) {
            densify_stats[r.gaussian] += vec2(size, 1.0);
        }
    }
}

#ifdef GROUP
// A splat by all invocations: each adds up every 64th record, and a tree their sums.
void gather_together(uint s) {
    uint lane = gl_LocalInvocationID.x;
    Records r = records(s);
    Sums sums = sum_records(r, lane, WALKERS);
    for (uint width = WALKERS / 2u; width > 0u; width /= 2u) {
        if (lane >= width && lane < 2u * width) {
            shared_a[lane - width] = sums.a;
            shared_b[lane - width] = sums.b;
            shared_c[lane - width] = sums.c;
        }
        barrier();
        if (lane < width) {
            sums.a += shared_a[lane];
            sums.b += shared_b[lane];
            sums.c += shared_c[lane];
        }
        barrier();
    }
    if (lane == 0u) {
        finish(s, r, sums);
    }
}
#endif

void main() {
    uint s = linear_group_id() * 64u + gl_LocalInvocationID.x;
#ifdef GROUP
    if (gl_LocalInvocationID.x == 0u) {
        large_count = 0u;
    }
    barrier();
#endif
    if (s < counters.visible_count && failure == 0u) {
        Records r = records(s);
#ifdef GROUP
        if (r.total > WALKERS) {
            large[atomicAdd(large_count, 1u)] = s; // in any order: each splat is summed for itself
        } else
#endif
        {
            finish(s, r, sum_records(r, 0u, 1u));
        }
    }
#ifdef GROUP
    barrier();
    for (uint k = 0u; k < large_count; k++) {
        gather_together(large[k]);
    }
#endif
}
