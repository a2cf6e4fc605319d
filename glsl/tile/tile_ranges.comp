#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
#include "subgroup.glsl"
// tile_ranges — find the start and end of each tile's list among the sorted pairs, the longest list, and (variant
// labels) the occupied tiles of object layers.
// Work:    one tile of one layer per invocation; the grid covers the step's layers. There are far fewer tiles than
//          pairs, so a binary search per tile is cheaper than a test per pair.
// Reads:   step, counters; tile_keys [I] sorted (KEYS_PER_WORD 2: 16-bit)
// Writes:  tile_starts, tile_ends [layers * T], equal for an empty list; counters.longest_list (integer maximum, any
//          order); variant labels: layer_occupied [layers * T] 0 or 1; otherwise the last workgroup writes what depends
//          on the longest list (count_args.glsl): dispatch_args, counters.failure; variant parts: long_chunks (tile,
//          chunk), the chunks of the scene's long lists (long_lists.glsl); first_lists, the tiles of the next longest
//          lists; both in any order; counters.long_chunk_count, first_list_count
// Mirror:  src/reference/tile.rs::tile_ranges, tile.rs::tile_lengths

layout(constant_id = 23) const uint KEYS_PER_WORD = 1;
layout(local_size_x = 64) in;
READ1(0, StepUniforms, step);
INOUT1(2, Counters, counters);
FETCHU(3, tile_keys);
WRITE(4, uint, tile_starts);
WRITE(5, uint, tile_ends);
#ifdef LABELS
WRITE(6, uint, layer_occupied);
#else
INOUT(7, uint, dispatch_args);
#include "arrival.glsl"
#include "count_args.glsl"
#endif
#ifdef PARTS
WRITE(8, uvec2, long_chunks);
WRITE(9, uint, first_lists);
layout(constant_id = 14) const uint CHUNK_LENGTH = 256;
#include "long_lists.glsl"
#endif

uint key_at(uint i) {
    if (KEYS_PER_WORD == 1u) {
        return fetchu(tile_keys, i);
    }
    return (fetchu(tile_keys, i >> 1u) >> 16u * (i & 1u)) & 0xffffu;
}

// The first pair with a key of at least `key`, which may be one above the 16-bit range.
uint first_not_less(uint key, uint count) {
    uint low = 0u, high = count;
    while (low < high) {
        uint middle = (low + high) / 2u;
        bool less = key_at(middle) < key;
        low = less ? middle + 1u : low;
        high = less ? high : middle;
    }
    return low;
}

void main() {
    uint t = linear_group_id() * 64u + gl_LocalInvocationID.x;
    bool some = t < step.tile_count * (step.layer_count + 1u);
    uint count = some && counters.failure == 0u ? counters.instance_count : 0u;
    uint start = first_not_less(t, count), end = first_not_less(t + 1u, count);
    uint longest = subgroup_max(end - start);
    if (subgroup_elect() && longest > 0u) {
        atomicMax(counters.longest_list, longest);
    }
    if (some) {
        tile_starts[t] = start;
        tile_ends[t] = end;
#ifdef LABELS
        layer_occupied[t] = t >= step.tile_count && end > start ? 1u : 0u;
#endif
    }
#ifdef PARTS
    if (t < step.tile_count && is_first(end - start)) {
        first_lists[atomicAdd(counters.first_list_count, 1u)] = t;
    }
    if (t < step.tile_count && is_long(end - start)) {
        uint chunks = (end - start + CHUNK_LENGTH - 1u) / CHUNK_LENGTH;
        uint first = atomicAdd(counters.long_chunk_count, chunks);
        for (uint chunk = 0u; chunk < chunks; chunk++) {
            long_chunks[first + chunk] = uvec2(t, chunk);
        }
    }
#endif
#ifndef LABELS
    arrive(counters.ranges_groups);
    if (gl_LocalInvocationIndex == 0u && arrived_before + 1u == gl_NumWorkGroups.x * gl_NumWorkGroups.y) {
        put_blend(0u, atomicMax(counters.longest_list, 0u));
    }
#endif
}
