#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
#include "partitions.glsl"
// step_begin — clear the counters and size the dispatches over all Gaussians or all layers.
// Work:    one invocation.
// Reads:   step
// Writes:  counters; dispatch_args (all entries; 0 for later stages)
// Mirror:  none (bookkeeping; every later pass fails without it)

layout(local_size_x = 1) in;
READ1(0, StepUniforms, step);
WRITE1(1, Counters, counters);
WRITE(2, uint, dispatch_args);

void put(uint at, uvec3 groups) {
    dispatch_args[at] = groups.x;
    dispatch_args[at + 1u] = groups.y;
    dispatch_args[at + 2u] = groups.z;
}

void main() {
    counters = Counters(0u, 0u, 0u, 0u, 0u, 0u, 0u, NO_SPLAT, 0u, NO_SPLAT, 0u, NO_SPLAT, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0.0, 0.0, 0.0);
    uint n = step.gaussian_count;
    put(ARGS_GAUSSIANS, folded_groups((n + 63u) / 64u));
    put(ARGS_SH1, folded_groups((n * 3u + 63u) / 64u));
    put(ARGS_SH2, folded_groups((n * 4u + 63u) / 64u));
    put(ARGS_SH3, folded_groups((n * 6u + 63u) / 64u));
    put(ARGS_TILES, folded_groups((step.tile_count * (step.layer_count + 1u) + 63u) / 64u));
    put(ARGS_SPLATS, uvec3(0u, 1u, 1u));
    put(ARGS_SWEEP_GAUSSIANS, folded_groups(partitions(n)));
    put(ARGS_SWEEP_SPLATS, uvec3(0u, 1u, 1u));
    put(ARGS_SWEEP_INSTANCES, uvec3(0u, 1u, 1u));
    put(ARGS_SWEEP_TILES, folded_groups(partitions(step.tile_count * (step.layer_count + 1u))));
    put(ARGS_BLEND, uvec3(0u, 1u, 1u));
    put(ARGS_CHUNKS, uvec3(0u, 1u, 1u));
    put(ARGS_WALK, uvec3(0u, 1u, 1u));
    put(ARGS_PRODUCTS, uvec3(0u, 1u, 1u));
}
