#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
#include "gaussian.glsl"
#include "record.glsl"
#include "ellipse.glsl"
#include "sort_key.glsl"
// emit_instances — write one (tile key, splat) pair for every tile of a splat.
// Work:    64 splats per workgroup. A splat's instances are contiguous: first in the scene layer, then in its object
//          layer; keys are layer * tile_count + tile.
// Reads:   step, counters; splats [V,3]; tiles_touched [V]; instance_offsets [V];
//          variant labels: gaussian_from_splat [V], labels [N], layer_from_label
// Writes:  tile_keys [I]; splat_from_instance [I]
// Mirror:  src/reference/tile.rs::emit_instances, tile.rs::row_interval

layout(local_size_x = 64) in;
READ1(0, StepUniforms, step);
READ1(1, Counters, counters);
FETCH4(3, splats);
FETCHU(4, tiles_touched);
FETCHU(5, instance_offsets);
WRITE(6, uint, tile_keys);
WRITE(7, uint, splat_from_instance);
#ifdef LABELS
FETCHU(8, gaussian_from_splat);
FETCHU(9, labels);
FETCHU(10, layer_from_label);
#endif
#include "pairs.glsl"

void emit(StepUniforms u, Target t, Ellipse e) {
    uint written = 0u;
    for (uint row = 0u; row < e.rows; row++) {
        uvec2 tiles = tiles_of_row(u, e, row);
        uint first = (e.y_min + row) * u.tiles_x + tiles.x;
        for (uint k = 0u; k < tiles.y; k++) {
            put_tile(u, t, written + k, first + k);
        }
        written += tiles.y;
    }
}

void main() {
    StepUniforms u = step;
    uint s = linear_group_id() * 64u + gl_LocalInvocationID.x;
    if (s >= counters.visible_count || counters.failure != 0u) {
        return;
    }
    Target t = Target(s, 0u, 0u, 0u);
#ifdef LABELS
    t.layer = fetchu(layer_from_label, fetchu(labels, fetchu(gaussian_from_splat, s)));
#endif
    t.first = fetchu(instance_offsets, s);
    t.count = fetchu(tiles_touched, s) / (t.layer != 0u ? 2u : 1u);
    if (t.count > 0u) {
        vec4 r0 = fetch4(splats, 3u * s), r1 = fetch4(splats, 3u * s + 1u), r2 = fetch4(splats, 3u * s + 2u);
        emit(u, t, ellipse(u, r0.xy, r2.zw, vec3(r0.zw, r1.x), r1.y));
    }
}
