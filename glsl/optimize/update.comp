#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
#include "gaussian.glsl"
#include "projection.glsl"
#include "sh.glsl"
#include "moments_store.glsl"
#include "strategy_moves.glsl"
#include "arrival.glsl"
// update — update the Gaussians that a step touched: sum the gradient records of each, carry them back to its
//          parameters, and apply its missed Adam updates, then the step's update.
// Work:    64 Gaussians of the model per workgroup, one per invocation; colours by vec4, distributed among the
//          invocations. A splat with many records is summed by all invocations, in a tree.
// Reads:   step, counters; splat_from_gaussian [N]; tiles_touched, instance_offsets [V]; v_instances_a, _b, _c [I];
//          missed; variant labels: labels [N], layer_from_label
// Writes:  parameters, first and second moments [N], active colours alone; touched_at [N]; densify_stats [N];
//          counters.nonfinite_* (integer atomics); variant poses: pose_partials [ceil(N / 64), 2]
// Math:    gather, project_backward and adam. A Gaussian with zero gradients is unchanged: it has missed one more
//          update (caught_up.glsl). MODES: move_all, too; variant poses: pose_backward. A Gaussian that is moved or
//          limited stays late: the stored value moves, and what it has missed is added to that.
// Order:   fixed, bitwise reproducible; no atomics on floats.
// Mirror:  src/reference/project.rs::project_backward, densify.rs::accumulate, adam.rs::adam, lazy.rs::caught_up

layout(constant_id = 11) const uint SH_DEGREE = 3;
layout(constant_id = 18) const uint CHANGES = 1; // 0: the statistic alone
layout(constant_id = 20) const uint MODES = 0;   // bits UPDATE_ of constants.glsl
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
INOUT_PLANES(11, 18, 25);
#ifdef LABELS
FETCHU(32, labels);
FETCHU(33, layer_from_label);
#endif
#ifdef POSES
WRITE(34, vec4, pose_partials);
#include "pose_sums.glsl"
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
#include "splat_backward.glsl"

shared uint seen_count;    // Gaussians with a splat
shared vec3 touched_colour[WALKERS]; // gradients of colours of those that are updated, and values of the harmonics
shared float touched_basis[15u * WALKERS];

// Updates everything except colours, and stores what the colour update needs. Returns the gradients of the pose.
void update_geometry(StepUniforms u, uint i, uint above, Sums sums, inout vec3 force, inout vec3 torque) {
    look_up_trained(u, i);
    vec4 mean = means_now(i), quat = quats_now(i);
    vec3 log_scale = scales_now(i).xyz;
    GaussianGradient v = project_splat_backward(u, i, mean, log_scale, quat, sums.a, sums.b, sums.c.x, above);
    vec3 offset = mean.xyz - u.camera_centre;
    force = v.mean;
#ifdef POSES
    torque = torque_of(offset, v.mean - v.by_direction, quat, v.quat);
#endif
    bool regularises = (MODES & UPDATE_REGULARISES) != 0u;
    if (CHANGES == 0u || i >= u.trained_count || !(v.is_finite || regularises)) {
        return;
    }
    if (regularises) {
        regularise(u, mean.w, log_scale, v.logit, v.log_scale);
    }
    means_step(u, i, vec4(v.mean, v.logit), u.rate_means);
    scales_step(u, i, vec4(v.log_scale, 0.0), vec4(u.rate_scales));
    quats_step(u, i, v.quat, vec4(u.rate_quats));
    touched_at[i] = missed[0].x + 1u;
    uint slot = touch(i);
    touched_colour[slot] = v.colour;
    float inv_distance, basis[15];
    sh_basis(direction_of(offset, inv_distance), SH_DEGREE, basis);
    for (uint k = 0u; k < 15u; k++) {
        touched_basis[15u * slot + k] = basis[k];
    }
}

// Moves and limits a Gaussian after the step's update, which it may have missed.
void explore_and_smooth(StepUniforms u, uint i) {
    look_up_after(u, i);
    if ((MODES & UPDATE_EXPLORES) != 0u) {
        means[i].xyz += random_move(u, i, means_now(i).w, scales_now(i).xyz, quats_now(i));
    }
    if ((MODES & UPDATE_SMOOTHS) != 0u) {
        vec4 s = scales[i], m, v;
        float limit = smallest_size(u, means_now(i).xyz, s.w);
        if (!is_late || limit != s.w) {
            load_moments(scales, i, m, v);
            vec4 missing = is_late ? late_rest.x * late_direction(m, v) : vec4(0.0);
            vec4 now = is_late ? limited(s - missing) : s;
            scales[i] = limited(vec4(now.xyz, limit)) + missing;
        }
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

#define STEP_SH0(name, e, slot, first) name##_step(u, e, \
    vec4(SH_C0 * touched_colour[slot], coefficient_gradient(slot, 0u).x), vec4(vec3(u.rate_sh0), u.rate_sh_rest))
#define STEP(name, e, slot, first) name##_step(u, e, coefficient_gradient(slot, first), vec4(u.rate_sh_rest))

void main() {
    StepUniforms u = step;
    uint lane = gl_LocalInvocationID.x, group = linear_group_id(), i = group * WALKERS + lane;
    if (lane == 0u) {
        seen_count = 0u;
        touched_count = 0u;
    }
    barrier();
    bool is_trained = i < u.trained_count && counters.failure == 0u;
#ifdef POSES
    bool counts = i < u.gaussian_count && counters.failure == 0u;
#else
    bool counts = is_trained;
#endif
    uint word = counts ? fetchu(splat_from_gaussian, i) : NO_SPLAT;
    bool is_seen = word != NO_SPLAT;
    if (is_seen) {
        atomicAdd(seen_count, 1u);
    }
    barrier();
    vec3 force = vec3(0.0), torque = vec3(0.0);
    if (seen_count > 0u) {
        Records r = Records(0u, 0u, 0u, i);
        if (is_seen) {
            r = records(word & SPLAT_MASK, i);
        }
        Sums sums = sum_all(r);
        note_gradient(r, sums);
        bool has_gradient = any(notEqual(sums.a, vec4(0.0))) || any(notEqual(sums.b, vec4(0.0))) || sums.c.x != 0.0;
        if (has_gradient || ((MODES & UPDATE_REGULARISES) != 0u && is_seen)) {
            update_geometry(u, i, word >> SPLAT_BITS, sums, force, torque);
        }
        // Others write the coefficients that an invocation has read for its gradient.
        buffer_barrier();
        EACH_COLOUR(sh0, 0u, 1u, 0u, STEP_SH0)
        EACH_COLOUR(sh1, 1u, 2u, 1u, STEP)
        EACH_COLOUR(sh2, 2u, 4u, 9u, STEP)
        EACH_COLOUR(sh3, 3u, 5u, 25u, STEP)
    }
    if ((MODES & (UPDATE_EXPLORES | UPDATE_SMOOTHS)) != 0u && is_trained) {
        explore_and_smooth(u, i);
    }
#ifdef POSES
    sum_pose(force, torque);
    if (lane == 0u && i < u.gaussian_count) {
        pose_partials[2u * group] = vec4(forces[0], 0.0);
        pose_partials[2u * group + 1u] = vec4(torques[0], 0.0);
    }
#endif
}
