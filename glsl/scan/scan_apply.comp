#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "count.glsl"
#include "saturate.glsl"
// scan_apply — third of three: each lane writes the exclusive prefix sum of its share.
// Work:    as scan_reduce.
// Reads:   step, counters; values [n]; partials [LANES] (exclusive)
// Writes:  offsets [n]
// Order:   exact integers, equal in every run.
// Mirror:  src/reference/scan.rs::exclusive_scan

layout(constant_id = 0) const uint SUBGROUP_SIZE = 8;
layout(local_size_x_id = 0) in;
READ1(0, StepUniforms, step);
READ1(1, Counters, counters);
FETCHU(3, values);
READ(4, uint, partials);
WRITE(5, uint, offsets);

void main() {
    uint n = item_count(step, counters, counters.failure);
    uint lane = gl_GlobalInvocationID.x;
    uint share = (n + LANES - 1u) / LANES;
    uint begin = min(lane * share, n), end = min(begin + share, n);
    uint running = partials[lane];
    for (uint i = begin; i < end; i++) {
        uint v = fetchu(values, i);
#ifdef FLAG
        v = v != KEY_INVISIBLE ? 1u : 0u;
#endif
        offsets[i] = running;
        running = saturating_add(running, v);
    }
}
