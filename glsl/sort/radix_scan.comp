#version 460
#include "layout.glsl"
// radix_scan — exclusive scan of the whole histogram, digit-major, in place.
// Work:    one workgroup of one subgroup; lane i owns a contiguous share, a multiple of four cells, and adds four per
//          round: lavapipe ends both loops after 65,535 rounds in total.
// Reads:   histogram [CELLS]
// Writes:  histogram [CELLS]
// Order:   exact integers, equal in every run.
// Mirror:  src/verify/reference/sort.rs::radix_sort

#include "subgroup.glsl"
layout(constant_id = 6) const uint CELLS = 8192;
layout(local_size_x_id = 0) in;
INOUT(0, uint, histogram);

void main() {
    uint lane = gl_LocalInvocationID.x;
    uint share = CELLS / SUBGROUP_SIZE;
    uint begin = lane * share, end = begin + share;
    uint sum = 0u;
    for (uint i = begin; i < end; i += 4u) {
        sum += histogram[i] + histogram[i + 1u] + histogram[i + 2u] + histogram[i + 3u];
    }
    uint running = subgroup_exclusive_add(sum);
    for (uint i = begin; i < end; i += 4u) {
        uvec4 v = uvec4(histogram[i], histogram[i + 1u], histogram[i + 2u], histogram[i + 3u]);
        histogram[i] = running;
        histogram[i + 1u] = running + v.x;
        histogram[i + 2u] = running + v.x + v.y;
        histogram[i + 3u] = running + v.x + v.y + v.z;
        running += v.x + v.y + v.z + v.w;
    }
}
