// Sizes dispatches by what was counted. Step, counters, failure and dispatch_args are declared before.

#include "dispatch.glsl"

void put_groups(uint at, uint count) {
    uvec3 groups = folded_groups(count);
    dispatch_args[at] = groups.x;
    dispatch_args[at + 1u] = groups.y;
}

// All tiles of the scene, then the occupied tiles of object layers, given the longest list. Nothing after any failure: pairs that were only counted have no
// lists, and the backward walk no chunks to find.
void put_blend(uint layers, uint longest) {
    failure |= (layers > step.layer_tile_capacity ? FAILED_LAYER_TILES : 0u)
        | (longest > step.longest_list ? FAILED_SEGMENTS : 0u);
    uint jobs = step.tile_count + layers;
    put_groups(ARGS_BLEND, failure != 0u ? 0u : jobs);
    if (step.chunk_length > 0u) {
        put_groups(ARGS_CHUNKS, failure != 0u ? 0u : counters.instance_count / step.chunk_length + jobs);
        // Other workgroups of this dispatch may have counted them.
        uint parts = atomicAdd(counters.long_chunk_count, 0u), firsts = atomicAdd(counters.first_list_count, 0u);
        put_groups(ARGS_WALK, failure != 0u ? 0u : parts + firsts + jobs);
        put_groups(ARGS_PRODUCTS, failure != 0u ? 0u : parts);
    }
}
