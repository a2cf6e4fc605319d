#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
#include "partitions.glsl"
// prepare_instances — detect an overflow of the buffers of (splat, tile) pairs; on overflow, no pairs are written.
// Work:    one invocation.
// Reads:   step; counters.instance_count (the need, even beyond capacity)
// Writes:  on overflow: failure (sticky bit); dispatch_args (splats) become 0
// Mirror:  none (bookkeeping; tests/train/overflow.rs)

layout(local_size_x = 1) in;
INOUT1(0, Counters, counters);
INOUT(1, uint, dispatch_args);
INOUT1(2, uint, failure);
READ1(3, StepUniforms, step);

void main() {
    uint needed = counters.instance_count;
    if (needed > step.instance_capacity) {
        failure |= FAILED_INSTANCES;
        dispatch_args[ARGS_SPLATS] = 0u;
    }
    uvec3 groups = folded_groups(failure != 0u ? 0u : partitions(needed));
    dispatch_args[ARGS_SWEEP_INSTANCES] = groups.x;
    dispatch_args[ARGS_SWEEP_INSTANCES + 1u] = groups.y;
}
