#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "count.glsl"
#include "saturate.glsl"
// scan_sweep — exclusive prefix sum in one dispatch; or (variant list) lists the occupied tiles of object layers.
// Work:    one partition of SWEEP_LANES x SWEEP_ITEMS items per workgroup.
// Reads:   step, counters; values [n] (variant list: 1 for an occupied tile)
// Writes:  offsets [n]; sweep; what follows from the total (total.glsl): counters, dispatch_args
//          variant list: layer_tiles [occupied] (layer * T + tile)
// Order:   exact integers, equal in every run. Sums from 2^30 on become 2^32 - 1 in the counter.
// Mirror:  src/reference/scan.rs::exclusive_scan

#define EXCHANGE_LANES SWEEP_LANES
#include "subgroup.glsl"
layout(local_size_x = SWEEP_LANES) in;
READ1(0, StepUniforms, step);
INOUT1(1, Counters, counters);
READ(3, uint, values);
INOUT(4, uint, sweep);
INOUT(7, uint, dispatch_args);
#ifdef LIST
WRITE(5, uint, layer_tiles);
#else
WRITE(5, uint, offsets);
#endif
#include "sweep.glsl"
#include "total.glsl"

shared uint sums[SWEEP_SUBGROUPS];
shared uint prefix;

uint value(uint i, uint n) {
    return i < n ? values[i] : 0u;
}

uint counted_items() {
    return item_count(step, counters, counters.failure);
}

void sweep_recount(uint part) {
    uint n = counted_items(), sum = 0u;
    for (uint k = 0u; k < SWEEP_ITEMS; k++) {
        sum = saturating_add(sum, value(sweep_item(part, k), n));
    }
    sweep_found[sweep_lane()] = min(sum, SWEEP_SUM);
    barrier();
    if (sweep_lane() == 0u) {
        for (uint i = 1u; i < SWEEP_LANES; i++) {
            sweep_found[0] = sweep_add(sweep_found[0], sweep_found[i]);
        }
    }
    barrier();
}

void main() {
    uint n = counted_items(), part = sweep_partition(), lane = sweep_lane();
    if (part * SWEEP_PARTITION >= n) {
        return;
    }
    uint before[SWEEP_ITEMS];
    uint low = 0u, high = 0u;
    [[unroll]] for (uint k = 0u; k < SWEEP_ITEMS; k++) {
        uint v = value(sweep_item(part, k), n), last = SUBGROUP_SIZE - 1u;
        uint v_low = v & 0xffffu, v_high = v >> 16u;
        uint low_before = subgroup_exclusive_add(v_low), high_before = subgroup_exclusive_add(v_high);
        before[k] = joined(low + low_before, high + high_before);
        low += subgroup_shuffle(low_before + v_low, last);
        high += subgroup_shuffle(high_before + v_high, last);
    }
    if (subgroup_lane() == 0u) {
        sums[subgroup_id()] = joined(low, high);
    }
    barrier();
    uint own = 0u, first = 0u;
    for (uint s = 0u; s < SWEEP_SUBGROUPS; s++) {
        first = s == subgroup_id() ? own : first;
        own = sweep_add(own, sums[s]);
    }
    uint found = sweep_look_back(part, lane == 0u, own);
    if (lane == 0u) {
        prefix = found;
        if (part == (n - 1u) / SWEEP_PARTITION) {
            uint total = sweep_add(found, own);
            put_total(total == SWEEP_SUM ? 0xffffffffu : total);
        }
    }
    barrier();
    first = sweep_add(first, prefix);
    [[unroll]] for (uint k = 0u; k < SWEEP_ITEMS; k++) {
        uint i = sweep_item(part, k);
        if (i < n) {
            uint to = sweep_add(first, before[k]);
#ifdef LIST
            if (values[i] != 0u && to < step.layer_tile_capacity) {
                layer_tiles[to] = i;
            }
#else
            offsets[i] = to;
#endif
        }
    }
}
