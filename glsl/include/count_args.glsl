// Writes what depends on a count: its counter, and dispatch sizes, unless it exceeds the capacity. Step, counters and
// dispatch_args are declared before.

#include "dispatch.glsl"
#include "partitions.glsl"

void put_groups(uint at, uint count) {
    uvec3 groups = folded_groups(count);
    dispatch_args[at] = groups.x;
    dispatch_args[at + 1u] = groups.y;
}

void put_visible(uint total) {
    counters.visible_count = total;
    put_groups(ARGS_SPLATS, (total + 63u) / 64u);
    put_groups(ARGS_SWEEP_SPLATS, partitions(total));
}

// Adds failures, and returns whether there is any. Atomic, because other workgroups of the dispatch read the word.
bool fails(uint bits) {
    return (atomicOr(counters.failure, bits) | bits) != 0u;
}

// The need, even beyond capacity; then no pairs are written.
void put_instances(uint total) {
    counters.instance_count = total;
    if (total > step.instance_capacity) {
        dispatch_args[ARGS_SPLATS] = 0u;
    }
    bool has_failed = fails(total > step.instance_capacity ? FAILED_INSTANCES : 0u);
    put_groups(ARGS_SWEEP_INSTANCES, has_failed ? 0u : partitions(total));
}

// All tiles of the scene, then the occupied tiles of object layers, given the longest list. Nothing after any failure:
// pairs that were only counted have no lists, and the backward pass has no chunks.
void put_blend(uint layers, uint longest) {
    bool has_failed = fails((layers > step.layer_tile_capacity ? FAILED_LAYER_TILES : 0u)
        | (longest > step.longest_list ? FAILED_SEGMENTS : 0u));
    uint jobs = step.tile_count + layers;
    put_groups(ARGS_BLEND, has_failed ? 0u : jobs);
    if (step.chunk_length > 0u) {
        put_groups(ARGS_CHUNKS, has_failed ? 0u : counters.instance_count / step.chunk_length + jobs);
        // Other workgroups of this dispatch may have counted them.
        uint parts = atomicAdd(counters.long_chunk_count, 0u), firsts = atomicAdd(counters.first_list_count, 0u);
        put_groups(ARGS_WALK, has_failed ? 0u : parts + firsts + jobs);
        put_groups(ARGS_PRODUCTS, has_failed ? 0u : parts);
    }
}
