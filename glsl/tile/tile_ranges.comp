#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
// tile_ranges — find where each tile's splats begin and end in the sorted list, and resolve slots to splats.
// Work:    64 instances a workgroup. tile_starts and tile_ends are zero before.
// Reads:   counters, failure; tile_keys [I] sorted; slots [I] (pre-sort position); splat_from_instance [I]
// Writes:  tile_starts, tile_ends [layers * T]; sorted_splats [I]
// Mirror:  tests/reference/tile.rs::tile_ranges

layout(local_size_x = 64) in;
READ1(0, Counters, counters);
READ1(1, uint, failure);
FETCHU(2, tile_keys);
FETCHU(3, slots);
FETCHU(4, splat_from_instance);
WRITE(5, uint, tile_starts);
WRITE(6, uint, tile_ends);
WRITE(7, uint, sorted_splats);

void main() {
    uint i = linear_group_id() * 64u + gl_LocalInvocationID.x;
    uint n = counters.instance_count;
    if (i >= n || failure != 0u) {
        return;
    }
    uint key = fetchu(tile_keys, i);
    uint before = i > 0u ? fetchu(tile_keys, i - 1u) : ~key;
    uint after = i + 1u < n ? fetchu(tile_keys, i + 1u) : ~key;
    if (before != key) {
        tile_starts[key] = i;
    }
    if (after != key) {
        tile_ends[key] = i + 1u;
    }
    sorted_splats[i] = fetchu(splat_from_instance, fetchu(slots, i));
}
