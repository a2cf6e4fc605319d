#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
#include "moments_store.glsl"
// catch_up — apply all missed Adam updates.
// Work:    64 Gaussians per workgroup; their vec4 are distributed among the invocations.
// Reads:   step, counters; missed
// Writes:  parameters, first and second moments [N], active colours only; touched_at [N] of Gaussians that had missed
//          updates
// Math:    see caught_up.glsl. A separate list does so also after a failure.
// Mirror:  src/reference/lazy.rs::caught_up

layout(constant_id = 11) const uint SH_DEGREE = 3;
layout(local_size_x = 64) in;
READ1(0, StepUniforms, step);
READ1(1, Counters, counters);
INOUT(2, uint, touched_at);
READ(3, uvec4, missed);
INOUT(4, vec4, means);
INOUT(5, vec4, scales);
INOUT(6, vec4, quats);
INOUT(7, vec4, sh0);
INOUT(8, vec4, sh1);
INOUT(9, vec4, sh2);
INOUT(10, vec4, sh3);
MOMENTS(11, 18, means);
MOMENTS(12, 19, scales);
MOMENTS(13, 20, quats);
MOMENTS(14, 21, sh0);
MOMENTS(15, 22, sh1);
MOMENTS(16, 23, sh2);
MOMENTS(17, 24, sh3);

#define LAZY
#define plane4(name, e) name[e]
#define touched(i) touched_at[i]
#include "caught_up.glsl"
#include "late_adam.glsl"

shared uint late_count; // Gaussians that have missed updates: rows, and how many they missed
shared uint late_row[64];
shared uint late_age[64];

// Finds the late Gaussian of a vec4 in a plane with this many vec4 per Gaussian. Returns its element.
uint find(uint at, uint stride) {
    uint slot = at / stride;
    look_up(late_age[slot]);
    return stride * late_row[slot] + (at - slot * stride);
}

void main() {
    uint lane = gl_LocalInvocationID.x, i = linear_group_id() * 64u + lane;
    if (lane == 0u) {
        late_count = 0u;
    }
    barrier();
    uint age = i < step.trained_count && (counters.failure == 0u || missed[0].z != 0u) ? missed_updates(i) : 0u;
    if (age > 0u) {
        uint slot = atomicAdd(late_count, 1u); // in any order: each catches up for itself
        late_row[slot] = i;
        late_age[slot] = age;
        touched_at[i] = missed[0].x;
    }
    barrier();
    for (uint at = lane; at < late_count; at += 64u) {
        uint e = find(at, 1u);
        means_catch_up(e);
        scales_catch_up(e);
        quats_catch_up(e);
        sh0_catch_up(e);
    }
    for (uint at = lane; SH_DEGREE >= 1u && at < 2u * late_count; at += 64u) {
        sh1_catch_up(find(at, 2u));
    }
    for (uint at = lane; SH_DEGREE >= 2u && at < 4u * late_count; at += 64u) {
        sh2_catch_up(find(at, 4u));
    }
    for (uint at = lane; SH_DEGREE >= 3u && at < 5u * late_count; at += 64u) {
        sh3_catch_up(find(at, 5u));
    }
}
