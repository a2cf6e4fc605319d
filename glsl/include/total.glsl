// Takes the total of a scan: to its counter, and to the dispatches over what it counts, unless it does not fit. Step, counters,
// failure and dispatch_args are declared before.

#include "blend_args.glsl"
#include "partitions.glsl"

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
        put_blend(total, counters.longest_list);
    } else {
        counters.densified_count = total;
    }
}
