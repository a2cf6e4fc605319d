// Takes the total of a scan: to its counter, and to the dispatches over what it counts, unless it does not fit. Step, counters,
// failure and dispatch_args are declared before.

#include "dispatch.glsl"
#include "partitions.glsl"

void put_groups(uint at, uint count) {
    uvec3 groups = folded_groups(count);
    dispatch_args[at] = groups.x;
    dispatch_args[at + 1u] = groups.y;
}

// All tiles of the scene, then the occupied tiles of object layers. Nothing after any failure: pairs that were only counted have no
// lists, and the backward walk no chunks to find.
void put_blend(uint layers) {
    failure |= (layers > step.layer_tile_capacity ? FAILED_LAYER_TILES : 0u)
        | (counters.longest_list > step.longest_list ? FAILED_SEGMENTS : 0u);
    uint jobs = step.tile_count + layers;
    put_groups(ARGS_BLEND, failure != 0u ? 0u : jobs);
    if (step.chunk_length > 0u) {
        put_groups(ARGS_CHUNKS, failure != 0u ? 0u : counters.instance_count / step.chunk_length + jobs);
        put_groups(ARGS_WALK, failure != 0u ? 0u : counters.long_chunk_count + counters.first_list_count + jobs);
        put_groups(ARGS_PRODUCTS, failure != 0u ? 0u : counters.long_chunk_count);
    }
}

void put_total(uint total) {
    if (TOTAL == 0u) {
        counters.visible_count = total;
        put_groups(ARGS_SPLATS, (total + 63u) / 64u);
        put_groups(ARGS_SWEEP_SPLATS, partitions(total));
    } else if (TOTAL == 1u) {
        // The need, even beyond capacity; then no pairs are written.
        counters.instance_count = total;
        if (total > step.instance_capacity) {
            failure |= FAILED_INSTANCES;
            dispatch_args[ARGS_SPLATS] = 0u;
        }
        put_groups(ARGS_SWEEP_INSTANCES, failure != 0u ? 0u : partitions(total));
    } else if (TOTAL == 2u) {
        counters.layer_tile_count = total;
        put_blend(total);
    } else {
        counters.densified_count = total;
    }
}
