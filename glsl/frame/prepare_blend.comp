#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
// prepare_blend — size the blend dispatches: all tiles of the scene, then the occupied tiles of the object layers.
// Work:    one invocation.
// Reads:   step, counters
// Writes:  dispatch_args (blend); failure (sticky bits)
// Mirror:  none (bookkeeping; tests/train/overflow.rs)

layout(local_size_x = 1) in;
READ1(0, StepUniforms, step);
READ1(1, Counters, counters);
INOUT(2, uint, dispatch_args);
INOUT1(3, uint, failure);

void main() {
    uint layers = counters.layer_tile_count;
    uint failed = (layers > step.layer_tile_capacity ? FAILED_LAYER_TILES : 0u)
        | (counters.longest_list > step.longest_list ? FAILED_SEGMENTS : 0u);
    failure |= failed;
    uvec3 groups = folded_groups(failed != 0u ? 0u : step.tile_count + layers);
    dispatch_args[ARGS_BLEND] = groups.x;
    dispatch_args[ARGS_BLEND + 1u] = groups.y;
}
