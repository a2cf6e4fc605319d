#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
#include "partitions.glsl"
// prepare_splats — size the dispatches over the visible splats.
// Work:    one invocation.
// Reads:   counters.visible_count
// Writes:  dispatch_args (splats, and partitions of them)
// Mirror:  none (bookkeeping)

layout(local_size_x = 1) in;
READ1(0, Counters, counters);
INOUT(1, uint, dispatch_args);

void main() {
    uvec3 groups = folded_groups((counters.visible_count + 63u) / 64u);
    dispatch_args[ARGS_SPLATS] = groups.x;
    dispatch_args[ARGS_SPLATS + 1u] = groups.y;
    groups = folded_groups(partitions(counters.visible_count));
    dispatch_args[ARGS_SWEEP_SPLATS] = groups.x;
    dispatch_args[ARGS_SWEEP_SPLATS + 1u] = groups.y;
}
