#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "count.glsl"
#include "saturate.glsl"
// scan_reduce — first of three: each lane sums its contiguous share of the values.
// Work:    LANES lanes over all workgroups; lane i owns values [i c, (i+1) c), c = ceil(n / LANES).
// Reads:   step, counters; values [n] (variant flag: counts values other than KEY_INVISIBLE)
// Writes:  partials [LANES]
// Order:   exact integers, equal in every run.
// Mirror:  src/reference/scan.rs::exclusive_scan

layout(constant_id = 0) const uint SUBGROUP_SIZE = 8;
layout(local_size_x_id = 0) in;
READ1(0, StepUniforms, step);
READ1(1, Counters, counters);
FETCHU(3, values);
WRITE(4, uint, partials);

void main() {
    uint n = item_count(step, counters, counters.failure);
    uint lane = gl_GlobalInvocationID.x;
    uint share = (n + LANES - 1u) / LANES;
    uint begin = min(lane * share, n), end = min(begin + share, n);
    uint sum = 0u;
    for (uint i = begin; i < end; i++) {
        uint v = fetchu(values, i);
#ifdef FLAG
        v = v != KEY_INVISIBLE ? 1u : 0u;
#endif
        sum = saturating_add(sum, v);
    }
    partials[lane] = sum;
}
