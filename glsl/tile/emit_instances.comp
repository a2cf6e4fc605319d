#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
#include "record.glsl"
#include "ellipse.glsl"
// emit_instances — write one (tile key, splat) pair for every tile of a splat.
// Work:    64 splats per workgroup. A splat's instances are contiguous: first those of the scene layer, then
//          those of its object layer; keys are layer * tile_count + tile.
// Reads:   step, counters, failure; splats [V,3]; tiles_touched [V]; instance_offsets [V];
//          variant labels: gaussian_from_splat [V], labels [N], layer_from_label
// Writes:  tile_keys [I]; splat_from_instance [I]; variant sweep: sweep (histograms of the digits of the keys)
// Mirror:  src/reference/tile.rs::emit_instances

layout(local_size_x = 64) in;
READ1(0, StepUniforms, step);
READ1(1, Counters, counters);
READ1(2, uint, failure);
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
#ifdef SWEEP
INOUT(11, uint, sweep);
#include "digit_counts.glsl"
#endif

void put(uint at, uint key, uint splat) {
    tile_keys[at] = key;
    splat_from_instance[at] = splat;
#ifdef SWEEP
    count_digits(key);
#endif
}

void emit(uint s) {
    StepUniforms u = step;
    uint total = fetchu(tiles_touched, s);
    uint layer = 0u;
#ifdef LABELS
    layer = fetchu(layer_from_label, fetchu(labels, fetchu(gaussian_from_splat, s)));
#endif
    uint count = layer != 0u ? total / 2u : total;
    if (count == 0u) {
        return;
    }
    vec4 r0 = fetch4(splats, 3u * s), r1 = fetch4(splats, 3u * s + 1u), r2 = fetch4(splats, 3u * s + 2u);
    vec3 q = vec3(r0.zw, r1.x);
    TileRect rect = tile_rect(u, r0.xy, r2.zw);
    uint first = fetchu(instance_offsets, s);
    uint written = 0u, tx = rect.x_min, ty = rect.y_min;
    for (uint k = 0u; k < rect.count; k++) {
        if (written < count && tile_touched(u, tx, ty, r0.xy, q, r1.y)) {
            uint tile = ty * u.tiles_x + tx;
            put(first + written, tile, s);
#ifdef LABELS
            if (layer != 0u) {
                put(first + count + written, layer * u.tile_count + tile, s);
            }
#endif
            written++;
        }
        bool wrap = tx == rect.x_max;
        tx = wrap ? rect.x_min : tx + 1u;
        ty += wrap ? 1u : 0u;
    }
}

void main() {
    uint s = linear_group_id() * 64u + gl_LocalInvocationID.x;
#ifdef SWEEP
    clear_bins(gl_LocalInvocationID.x, 64u);
    barrier();
#endif
    if (s < counters.visible_count && failure == 0u) {
        emit(s);
    }
#ifdef SWEEP
    barrier();
    add_bins(gl_LocalInvocationID.x, 64u);
#endif
}
