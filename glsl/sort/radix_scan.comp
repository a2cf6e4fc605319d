#version 460
#include "layout.glsl"
// radix_scan — exclusive scan of the whole histogram, digit-major, in place.
// Work:    one workgroup of one subgroup; lane i owns a contiguous share.
// Reads:   histogram [CELLS]
// Writes:  histogram [CELLS]
// Order:   exact integers, same in every run.
// Mirror:  src/reference/sort.rs::radix_sort

layout(constant_id = 0) const uint SUBGROUP_SIZE = 8;
layout(constant_id = 6) const uint CELLS = 8192;
layout(local_size_x_id = 0) in;
INOUT(0, uint, histogram);

void main() {
    uint lane = gl_LocalInvocationID.x;
    uint share = (CELLS + SUBGROUP_SIZE - 1u) / SUBGROUP_SIZE;
    uint begin = min(lane * share, CELLS), end = min(begin + share, CELLS);
    uint sum = 0u;
    for (uint i = begin; i < end; i++) {
        sum += histogram[i];
    }
    uint running = subgroupExclusiveAdd(sum);
    for (uint i = begin; i < end; i++) {
        uint v = histogram[i];
        histogram[i] = running;
        running += v;
    }
}
