#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
#include "partitions.glsl"
// step_begin — clear the counters and size the dispatches over all Gaussians or all layers.
// Work:    one invocation; variant look: many workgroups, to clear.
// Reads:   step
// Writes:  counters, except the failure; dispatch_args (all entries; 0 for later stages); variant look: look_back = 0
// Mirror:  none (bookkeeping; every later pass fails without it)

#ifdef LOOK
const uint BEGIN_LANES = 256u;
#else
const uint BEGIN_LANES = 1u;
#endif
layout(local_size_x = BEGIN_LANES) in;
READ1(0, StepUniforms, step);
INOUT1(1, Counters, counters);
WRITE(2, uint, dispatch_args);
#ifdef LOOK
WRITE(3, uint, look_back);
#endif

void put(uint at, uvec3 groups) {
    dispatch_args[at] = groups.x;
    dispatch_args[at + 1u] = groups.y;
    dispatch_args[at + 2u] = groups.z;
}

void main() {
#ifdef LOOK
    uint group = gl_WorkGroupID.x, lanes = gl_NumWorkGroups.x * BEGIN_LANES, lane = group * BEGIN_LANES + gl_LocalInvocationID.x;
    for (uint w = lane; w < CELLS; w += lanes) {
        look_back[w] = 0u;
    }
    if (lane > 0u) {
        return;
    }
#endif
    counters = Counters(0u, 0u, 0u, 0u, 0u, 0u, 0u, NO_SPLAT, 0u, NO_SPLAT, 0u, NO_SPLAT, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, counters.failure, 0.0, 0.0, 0.0);
    uint n = step.gaussian_count;
    put(ARGS_GAUSSIANS, folded_groups((n + 63u) / 64u));
    put(ARGS_SH1, folded_groups((n * 2u + 63u) / 64u));
    put(ARGS_SH2, folded_groups((n * 4u + 63u) / 64u));
    put(ARGS_SH3, folded_groups((n * 5u + 63u) / 64u));
    put(ARGS_TILES, folded_groups((step.tile_count * (step.layer_count + 1u) + 63u) / 64u));
#ifdef LOOK
    put(ARGS_VISIBLE, folded_groups(visible_partitions(n)));
#endif
    put(ARGS_SPLATS, uvec3(0u, 1u, 1u));
    put(ARGS_SWEEP_SPLATS, uvec3(0u, 1u, 1u));
    put(ARGS_SWEEP_INSTANCES, uvec3(0u, 1u, 1u));
    put(ARGS_BLEND, uvec3(0u, 1u, 1u));
    put(ARGS_CHUNKS, uvec3(0u, 1u, 1u));
    put(ARGS_WALK, uvec3(0u, 1u, 1u));
    put(ARGS_PRODUCTS, uvec3(0u, 1u, 1u));
}
