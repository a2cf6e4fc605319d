#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
// prepare_instances — detect an overflow of the buffers of (splat, tile) pairs; on overflow, no pairs are written.
// Work:    one invocation.
// Reads:   counters.instance_count (the need, even beyond capacity)
// Writes:  on overflow: failure (sticky bit); dispatch_args (splats) become 0
// Mirror:  none (bookkeeping; tests/train/overflow.rs)

layout(local_size_x = 1) in;
layout(constant_id = 3) const uint INSTANCE_CAPACITY = 65536;
INOUT1(0, Counters, counters);
INOUT(1, uint, dispatch_args);
INOUT1(2, uint, failure);

void main() {
    uint needed = counters.instance_count;
    if (needed > INSTANCE_CAPACITY) {
        failure |= FAILED_INSTANCES;
        dispatch_args[ARGS_SPLATS] = 0u;
    }
}
