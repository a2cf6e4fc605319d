#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "saturate.glsl"
// scan_spine — second of three: exclusive scan of the lanes' sums; the total goes to a counter.
// Work:    one workgroup of one subgroup.
// Reads:   step; partials [LANES]
// Writes:  partials [LANES] (exclusive); what follows from the total (total.glsl): counters, dispatch_args
// Order:   exact integers, equal in every run.
// Mirror:  src/reference/scan.rs::exclusive_scan

#include "subgroup.glsl"
layout(local_size_x_id = 0) in;
INOUT(0, uint, partials);
INOUT1(1, Counters, counters);
READ1(2, StepUniforms, step);
INOUT(4, uint, dispatch_args);
#include "total.glsl"

void main() {
    uint lane = gl_LocalInvocationID.x;
    uint share = (LANES + SUBGROUP_SIZE - 1u) / SUBGROUP_SIZE;
    uint begin = min(lane * share, LANES), end = min(begin + share, LANES);
    uint sum = 0u;
    for (uint i = begin; i < end; i++) {
        sum = saturating_add(sum, partials[i]);
    }
    // The sum is split into two halves; neither can overflow.
    uint low = subgroup_exclusive_add(sum & 0xffffu);
    uint high = subgroup_exclusive_add(sum >> 16u) + (low >> 16u);
    uint running = high > 0xffffu ? 0xffffffffu : (high << 16u) | (low & 0xffffu);
    if (lane == SUBGROUP_SIZE - 1u) {
        put_total(saturating_add(running, sum));
    }
    for (uint i = begin; i < end; i++) {
        uint v = partials[i];
        partials[i] = running;
        running = saturating_add(running, v);
    }
}
