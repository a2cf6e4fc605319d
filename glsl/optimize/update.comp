#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
#include "gaussian.glsl"
#include "projection.glsl"
#include "sh.glsl"
#include "moments_store.glsl"
// update — update the Gaussians that a step touched: sum the gradient records of each, carry them back to its
//          parameters, and apply its missed Adam updates, then the step's update.
// Work:    64 Gaussians of the model per workgroup, one per invocation; colours by vec4, distributed among the
//          invocations. A splat with many records is summed by all invocations, in a tree.
// Reads:   step, counters; splat_from_gaussian [N]; tiles_touched, instance_offsets [V]; v_instances_a, _b, _c [I];
//          missed; variant labels: labels [N], layer_from_label
// Writes:  parameters, first and second moments [N], active colours alone; touched_at [N]; densify_stats [N];
//          counters.nonfinite_* (integer atomics)
// Math:    gather, project_backward and adam. A Gaussian with zero gradients is unchanged: it has missed one more
//          update (caught_up.glsl).
// Order:   fixed, bitwise reproducible; no atomics on floats.
// Mirror:  src/reference/project.rs::project_backward, densify.rs::accumulate, adam.rs::adam, lazy.rs::caught_up

layout(constant_id = 11) const uint SH_DEGREE = 3;
layout(constant_id = 18) const uint CHANGES = 1; // 0: the statistic alone
const uint REST_FLOATS = 3u * SH_DEGREE * (SH_DEGREE + 2u); // of the coefficients above degree 0
layout(local_size_x = 64) in;
READ1(0, StepUniforms, step);
INOUT1(1, Counters, counters);
FETCHU(2, tiles_touched);
FETCHU(3, splat_from_gaussian);
FETCHU(4, instance_offsets);
FETCH4(5, v_instances_a);
FETCH4(6, v_instances_b);
FETCH2(7, v_instances_c);
INOUT(8, vec2, densify_stats);
INOUT(9, uint, touched_at);
READ(10, uvec4, missed);
INOUT(11, vec4, means);
INOUT(12, vec4, scales);
INOUT(13, vec4, quats);
INOUT(14, vec4, sh0);
INOUT(15, vec4, sh1);
INOUT(16, vec4, sh2);
INOUT(17, vec4, sh3);
MOMENTS(18, 25, means);
MOMENTS(19, 26, scales);
MOMENTS(20, 27, quats);
MOMENTS(21, 28, sh0);
MOMENTS(22, 29, sh1);
MOMENTS(23, 30, sh2);
MOMENTS(24, 31, sh3);
#ifdef LABELS
FETCHU(32, labels);
FETCHU(33, layer_from_label);
#endif

#define GROUP
#define LAZY
#define plane4(name, e) name[e]
#define touched(i) touched_at[i]
#include "caught_up.glsl"
EACH_PLANE(CAUGHT_UP)
#include "sh_colour.glsl"
#include "sh_backward.glsl"
#include "records.glsl"
#include "late_adam.glsl"

shared uint seen_count;    // Gaussians with a splat
shared uint large_lane[WALKERS]; // of the large ones
shared uint touched_count; // Gaussians with a gradient: row, what they missed of colours, and the gradients of these
shared uint touched_row[WALKERS];
shared vec4 touched_late[WALKERS];
shared vec3 touched_colour[WALKERS];
shared float touched_basis[15u * WALKERS];

// Sums the records of the Gaussian of each invocation that has a splat.
Sums sum_all(Records r, uint s) {
    uint lane = gl_LocalInvocationID.x;
    Sums sums = Sums(vec4(0.0), vec4(0.0), vec3(0.0));
    if (r.total > WALKERS) {
        uint k = atomicAdd(large_count, 1u); // in any order: each splat is summed for itself
        large[k] = s;
        large_lane[k] = lane;
    } else {
        sums = sum_records(r, 0u, 1u);
    }
    barrier();
    for (uint k = 0u; k < large_count; k++) {
        uint owner = large_lane[k];
        Sums all = sum_together(records(large[k], linear_group_id() * WALKERS + owner));
        if (lane == 0u) {
            shared_a[0] = all.a;
            shared_b[0] = all.b;
            shared_c[0] = all.c;
        }
        barrier();
        if (lane == owner) {
            sums = Sums(shared_a[0], shared_b[0], shared_c[0]);
        }
        barrier();
    }
    return sums;
}

// Updates everything except colours, and stores what the colour update needs.
void update_geometry(StepUniforms u, uint i, Sums sums) {
    look_up(missed_updates(i));
    vec4 mean = means_now(i), quat = quats_now(i);
    Projection p = project_gaussian(u, mean.xyz, scales_now(i).xyz, quat);
    vec4 a = sums.a, b = sums.b;
    float blue = sums.c.x;
    bool sane = finite(dot(abs(a), vec4(1.0)) + dot(abs(b), vec4(1.0)) + abs(blue));
#include "splat_backward.glsl"
    if (!sane) {
        atomicAdd(counters.nonfinite_count, 1u);
        atomicMin(counters.nonfinite_first, i);
    }
    if (!sane || CHANGES == 0u) {
        return;
    }
    means_step(u, i, vec4(v_mean, v_logit), u.rate_means);
    scales_step(u, i, vec4(v_log_scale, 0.0), vec4(u.rate_scales));
    quats_step(u, i, v_quat, vec4(u.rate_quats));
    touched_at[i] = missed[0].x + 1u;
    uint slot = atomicAdd(touched_count, 1u); // in any order: each is updated for itself
    touched_row[slot] = i;
    touched_late[slot] = is_late ? vec4(late_rest.zw, late_shrink) : vec4(0.0);
    touched_colour[slot] = v_colour;
    for (uint k = 0u; k < 15u; k++) {
        touched_basis[15u * slot + k] = basis[k];
    }
}

// Gradient of four floats of coefficients above degree 0; 0 above the active degree.
vec4 coefficient_gradient(uint slot, uint first) {
    vec4 g = vec4(0.0);
    for (uint c = 0u; c < 4u; c++) {
        uint at = first + c;
        g[c] = at < REST_FLOATS ? touched_basis[15u * slot + at / 3u] * touched_colour[slot][at % 3u] : 0.0;
    }
    return g;
}

// Finds the touched Gaussian of a vec4 in a plane with this many vec4 per Gaussian, and its element.
uint find(uint at, uint stride, out uint part) {
    uint slot = at / stride;
    part = at - slot * stride;
    vec4 late = touched_late[slot];
    is_late = late.z > 0.0;
    late_rest.zw = late.xy;
    late_shrink = late.zw;
    return slot;
}

void update_colours(StepUniforms u) {
    uint lane = gl_LocalInvocationID.x, part;
    for (uint at = lane; at < touched_count; at += WALKERS) {
        uint slot = find(at, 1u, part);
        float first = SH_DEGREE >= 1u ? touched_basis[15u * slot] * touched_colour[slot].x : 0.0;
        sh0_step(u, touched_row[slot], vec4(SH_C0 * touched_colour[slot], first), vec4(vec3(u.rate_sh0), u.rate_sh_rest));
    }
    vec4 rate = vec4(u.rate_sh_rest);
    for (uint at = lane; SH_DEGREE >= 1u && at < 2u * touched_count; at += WALKERS) {
        uint slot = find(at, 2u, part);
        sh1_step(u, 2u * touched_row[slot] + part, coefficient_gradient(slot, 1u + 4u * part), rate);
    }
    for (uint at = lane; SH_DEGREE >= 2u && at < 4u * touched_count; at += WALKERS) {
        uint slot = find(at, 4u, part);
        sh2_step(u, 4u * touched_row[slot] + part, coefficient_gradient(slot, 9u + 4u * part), rate);
    }
    for (uint at = lane; SH_DEGREE >= 3u && at < 5u * touched_count; at += WALKERS) {
        uint slot = find(at, 5u, part);
        sh3_step(u, 5u * touched_row[slot] + part, coefficient_gradient(slot, 25u + 4u * part), rate);
    }
}

void main() {
    StepUniforms u = step;
    uint lane = gl_LocalInvocationID.x, i = linear_group_id() * WALKERS + lane;
    if (lane == 0u) {
        seen_count = 0u;
        large_count = 0u;
        touched_count = 0u;
    }
    barrier();
    bool is_trained = i < u.trained_count && counters.failure == 0u;
    uint s = is_trained ? fetchu(splat_from_gaussian, i) : NO_SPLAT;
    if (s != NO_SPLAT) {
        atomicAdd(seen_count, 1u);
    }
    barrier();
    if (seen_count == 0u) {
        return;
    }
    Records r = Records(0u, 0u, 0u, i);
    if (s != NO_SPLAT) {
        r = records(s, i);
    }
    Sums sums = sum_all(r, s);
    note_gradient(r, sums);
    if (any(notEqual(sums.a, vec4(0.0))) || any(notEqual(sums.b, vec4(0.0))) || sums.c.x != 0.0) {
        update_geometry(u, i, sums);
    }
    barrier();
    update_colours(u);
}
