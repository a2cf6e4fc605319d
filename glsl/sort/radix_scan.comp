#version 460
#include "layout.glsl"
// radix_scan — exclusive scan of the workgroups' totals, digit-major, in place.
// Work:    one workgroup of one subgroup; lane i owns a contiguous share. Each round has several loads in flight,
//          because nothing else hides memory latency.
// Reads:   totals [CELLS]
// Writes:  totals [CELLS]
// Order:   exact integers, equal in every run.
// Mirror:  src/reference/sort.rs::radix_sort

#include "subgroup.glsl"
layout(local_size_x_id = 0) in;
INOUT(0, uint, totals);

const uint ROUND = 8u;

uint word(uint i, uint end) {
    uint v = totals[min(i, end - 1u)];
    return i < end ? v : 0u;
}

void main() {
    uint lane = gl_LocalInvocationID.x;
    uint share = (CELLS + SUBGROUP_SIZE - 1u) / SUBGROUP_SIZE;
    uint begin = min(lane * share, CELLS), end = min(begin + share, CELLS);
    uint sum = 0u;
    for (uint i = begin; i < end; i += ROUND) {
        [[unroll]] for (uint k = 0u; k < ROUND; k++) {
            sum += word(i + k, end);
        }
    }
    uint running = subgroup_exclusive_add(sum);
    for (uint i = begin; i < end; i += ROUND) {
        uint v[ROUND];
        [[unroll]] for (uint k = 0u; k < ROUND; k++) {
            v[k] = word(i + k, end);
        }
        [[unroll]] for (uint k = 0u; k < ROUND; k++) {
            if (i + k < end) {
                totals[i + k] = running;
            }
            running += v[k];
        }
    }
}
