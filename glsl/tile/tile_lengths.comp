#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
// tile_lengths — the longest list, and (variant labels) which tiles of object layers hold anything.
// Work:    one tile of one layer an invocation; the grid covers all layers that the plan allows.
// Reads:   step, failure; tile_starts, tile_ends [layers * T]
// Writes:  counters.longest_list (integer maximum, any order); variant labels: layer_occupied [layers * T] 0 or 1
// Mirror:  tests/reference/tile.rs::tile_lengths

layout(local_size_x = 64) in;
READ1(0, StepUniforms, step);
READ1(1, uint, failure);
FETCHU(2, tile_starts);
FETCHU(3, tile_ends);
INOUT1(4, Counters, counters);
#ifdef LABELS
WRITE(5, uint, layer_occupied);
#endif

void main() {
    uint t = gl_GlobalInvocationID.x;
    bool some = t < step.tile_count * (step.layer_count + 1u) && failure == 0u;
    uint length = some ? fetchu(tile_ends, t) - fetchu(tile_starts, t) : 0u;
    uint longest = subgroupMax(length);
    if (subgroupElect() && longest > 0u) {
        atomicMax(counters.longest_list, longest);
    }
#ifdef LABELS
    if (some) {
        layer_occupied[t] = t >= step.tile_count && length > 0u ? 1u : 0u;
    }
#endif
}
