#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
// feature_gather — add up the feature records of each splat, in instance order, as gather does.
// Work:    64 splats a workgroup.
// Reads:   step, counters; tiles_touched, instance_offsets [V]; v_instances_c [I] (stamps);
//          v_feature_instances [I,VECS]
// Writes:  v_features [V,stride]
// Order:   fixed, bitwise reproducible; no atomics.
// Mirror:  tools/bench/features/check.rs

layout(constant_id = 10) const uint VECS = 1;
layout(constant_id = 20) const uint CHUNK = 0; // first vec4 of the channels
layout(constant_id = 21) const uint STRIDE = 1; // vec4 a Gaussian
layout(local_size_x = 64) in;
READ1(0, StepUniforms, step);
READ1(1, Counters, counters);
FETCHU(2, tiles_touched);
FETCHU(3, instance_offsets);
FETCH4(4, v_instances_c);
FETCH4(5, v_feature_instances);
WRITE(6, vec4, v_features);

void main() {
    uint s = linear_group_id() * 64u + gl_LocalInvocationID.x;
    if (s >= counters.visible_count) {
        return;
    }
    uint stamp = step.stamp, total = fetchu(tiles_touched, s), first = fetchu(instance_offsets, s);
    vec4 sum[VECS];
    [[unroll]] for (uint v = 0u; v < VECS; v++) {
        sum[v] = vec4(0.0);
    }
    for (uint at = first; at < first + total; at++) {
        bool current = floatBitsToUint(fetch4(v_instances_c, at).y) == stamp;
        [[unroll]] for (uint v = 0u; v < VECS; v++) {
            vec4 record = fetch4(v_feature_instances, at * VECS + v);
            sum[v] += current ? record : vec4(0.0);
        }
    }
    [[unroll]] for (uint v = 0u; v < VECS; v++) {
        v_features[s * STRIDE + CHUNK + v] = sum[v];
    }
}
