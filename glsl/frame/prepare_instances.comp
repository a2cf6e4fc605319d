#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
// prepare_instances — size the dispatches over (splat, tile) pairs; flag an overflow of their buffers.
// Work:    one invocation.
// Reads:   counters.instance_count (what is needed, even beyond capacity)
// Writes:  dispatch_args (instances); failure (sticky bit); on overflow dispatch_args (splats) become 0
// Mirror:  none (bookkeeping; tests/overflow.rs)

layout(local_size_x = 1) in;
layout(constant_id = 3) const uint INSTANCE_CAPACITY = 0;
INOUT1(0, Counters, counters);
INOUT(1, uint, dispatch_args);
INOUT1(2, uint, failure);

void main() {
    uint needed = counters.instance_count;
    bool fits = needed <= INSTANCE_CAPACITY;
    if (!fits) {
        failure |= FAILED_INSTANCES;
    }
    uvec3 groups = folded_groups(fits ? (needed + 63u) / 64u : 0u);
    dispatch_args[ARGS_INSTANCES] = groups.x;
    dispatch_args[ARGS_INSTANCES + 1u] = groups.y;
    if (!fits) {
        dispatch_args[ARGS_SPLATS] = 0u;
    }
}
