#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
// layer_list — list the occupied tiles of the object layers.
// Work:    one tile of one layer per invocation.
// Reads:   step, counters; layer_occupied, layer_offsets [layers * T]
// Writes:  layer_tiles [occupied] (layer * T + tile)
// Mirror:  src/reference/scan.rs::compact

layout(local_size_x = 64) in;
READ1(0, StepUniforms, step);
READ1(1, Counters, counters);
FETCHU(2, layer_occupied);
FETCHU(3, layer_offsets);
WRITE(4, uint, layer_tiles);

void main() {
    uint t = linear_group_id() * 64u + gl_LocalInvocationID.x;
    if (t < step.tile_count * (step.layer_count + 1u) && counters.failure == 0u && fetchu(layer_occupied, t) != 0u) {
        uint to = fetchu(layer_offsets, t);
        if (to < step.layer_tile_capacity) {
            layer_tiles[to] = t;
        }
    }
}
