#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "count.glsl"
// scan_once — exclusive prefix sum in one dispatch; or (variant list) lists the occupied tiles of object layers.
// Work:    one item per invocation; the workgroups look back at the sums of earlier ones.
// Reads:   step, counters; values [n] (variant list: 1 for an occupied tile)
// Writes:  offsets [n]; look_back; what follows from the total (total.glsl): counters, dispatch_args
//          variant list: layer_tiles [occupied] (layer * T + tile)
// Order:   exact integers, equal in every run. Sums from 2^30 on become 2^32 - 1 in the counter.
// Mirror:  src/reference/scan.rs::exclusive_scan

layout(local_size_x = 64) in;
READ1(0, StepUniforms, step);
INOUT1(1, Counters, counters);
READ(3, uint, values);
INOUT(4, uint, look_back);
INOUT(7, uint, dispatch_args);
#ifdef LIST
WRITE(5, uint, layer_tiles);
#else
WRITE(5, uint, offsets);
#endif
#include "total.glsl"
#include "sums_before.glsl"
#include "look_back.glsl"

uint value(uint i) {
    return i < item_count(step, counters, 0u) ? values[i] : 0u;
}

// By halves, neither of which overflows.
uint sum_before(uint v, out uint sum) {
    uvec2 all, before = sums_before(uvec2(v & 0xffffu, v >> 16u), all);
    sum = joined(all.x, all.y);
    return joined(before.x, before.y);
}

uint look_recount(uint part) {
    uint sum;
    sum_before(value(part * WALKERS + gl_LocalInvocationIndex), sum);
    return sum;
}

void main() {
    bool has_failed;
    uint n = item_count(step, counters, 0u), part = look_partition(has_failed);
    uint i = part * WALKERS + gl_LocalInvocationIndex;
    if (part * WALKERS >= n || has_failed) {
        return;
    }
    uint own, before = sum_before(value(i), own), first = look_before(part, own);
    if (i == n - 1u) {
        put_total(total_of(first, own));
    }
    uint to = sweep_add(first, before);
#ifdef LIST
    if (i < n && values[i] != 0u && to < step.layer_tile_capacity) {
        layer_tiles[to] = i;
    }
#else
    if (i < n) {
        offsets[i] = to;
    }
#endif
}
