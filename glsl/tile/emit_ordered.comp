#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
#include "gaussian.glsl"
#include "record.glsl"
#include "ellipse.glsl"
#include "sort_key.glsl"
// emit_ordered — emit_instances on GPUs: write one (tile key, splat) pair for every tile of a splat, in depth order.
// Work:    64 splats per workgroup, in depth order; their rows and tiles are distributed among the invocations. A
//          splat's instances are contiguous: first in the scene layer, then in its object layer; keys are layer *
//          tile_count + tile.
// Reads:   step; order [V] splats by depth; splats [V,3]; tiles_touched [V];
//          variant labels: gaussian_from_splat [V], labels [N], layer_from_label
// Writes:  instance_offsets [V]; tile_keys [I] (variant narrow: 16-bit); splat_from_instance [I];
//          counters.instance_count, and what depends on it (count_args.glsl): dispatch_args; look_back, in variant
//          sweep also histograms of the digits of the keys
// Order:   exact integers, equal in every run. Pairs beyond the capacity are counted, not written.
// Mirror:  src/reference/tile.rs::emit_instances, tile.rs::row_interval, scan.rs::exclusive_scan

layout(local_size_x = ORDERED_LANES) in;
READ1(0, StepUniforms, step);
INOUT1(1, Counters, counters);
FETCH4(3, splats);
FETCHU(4, tiles_touched);
WRITE(5, uint, instance_offsets);
WRITE(6, KEY, tile_keys);
WRITE(7, uint, splat_from_instance);
#ifdef LABELS
FETCHU(8, gaussian_from_splat);
FETCHU(9, labels);
FETCHU(10, layer_from_label);
#endif
FETCHU(11, order);
INOUT(12, uint, look_back);
INOUT(13, uint, dispatch_args);
#ifdef SWEEP
#include "digit_counts.glsl"
#endif
#include "count_args.glsl"
#define WALKERS ORDERED_LANES
#include "rows.glsl"
#include "look_back.glsl"

#include "pairs.glsl"
shared Target targets[WALKERS];
shared uint tiles_before[WALKERS]; // of the splats before
shared uvec2 row_tiles[WALKERS];   // of a row: first tile, splat

uint touched(uint k) {
    return k < counters.visible_count ? fetchu(tiles_touched, fetchu(order, k)) : 0u;
}

uint look_recount(uint part) {
    uvec2 all;
    sums_before(uvec2(touched(part * ORDERED_LANES + gl_LocalInvocationIndex), 0u), all);
    return min(all.x, SWEEP_SUM);
}

// Rows of tiles by invocation, 64 at a time; then their tiles by invocation, so that neighbours write to adjacent
// addresses.
void emit(StepUniforms u, Target t, Ellipse e) {
    uint lane = gl_LocalInvocationIndex, written = 0u;
    targets[lane] = t;
    uint rows = share_rows(e, t.count, tiles_before[lane]);
    for (uint from = 0u; from < rows; from += WALKERS) {
        uint row = from + lane, splat = entry_at(0u, row);
        Ellipse shared_out = ellipse_of(splat);
        uvec2 tiles = row < rows ? tiles_of_row(u, shared_out, row - starts[splat]) : uvec2(0u), all;
        uint before = sums_before(uvec2(tiles.y, 0u), all).x;
        starts[WALKERS + lane] = before;
        row_tiles[lane] = uvec2((shared_out.y_min + row - starts[splat]) * u.tiles_x + tiles.x, splat);
        barrier();
        for (uint k = lane; k < all.x; k += WALKERS) {
            uint r = entry_at(1u, k);
            splat = row_tiles[r].y;
            put_tile(u, targets[splat], written + k - tiles_before[splat], row_tiles[r].x + k - starts[WALKERS + r]);
        }
        written += all.x;
    }
}

void main() {
    StepUniforms u = step;
    uint lane = gl_LocalInvocationIndex, visible = counters.visible_count;
    bool has_failed;
    uint part = look_partition(has_failed), k = part * ORDERED_LANES + lane;
    if (part * ORDERED_LANES >= visible || has_failed) {
        return;
    }
    uvec2 all, before = sums_before(uvec2(touched(k), 0u), all);
    uint own = min(all.x, SWEEP_SUM), first = look_before(part, own);
    if (part == (visible - 1u) / ORDERED_LANES && lane == 0u) {
        put_instances(total_of(first, own));
    }
#ifdef SWEEP
    clear_bins(lane, ORDERED_LANES);
    barrier();
#endif
    Target t = Target(0u, 0u, first + before.x, 0u);
    Ellipse e;
    e.rows = 0u;
    if (k < visible) {
        t.splat = fetchu(order, k);
        instance_offsets[t.splat] = t.first;
    }
    if (k < visible && first + own <= u.instance_capacity) {
        uint s = t.splat;
#ifdef LABELS
        t.layer = fetchu(layer_from_label, fetchu(labels, fetchu(gaussian_from_splat, s)));
#endif
        t.count = touched(k) / (t.layer != 0u ? 2u : 1u);
        if (t.count > 0u) {
            vec4 r0 = fetch4(splats, 3u * s), r1 = fetch4(splats, 3u * s + 1u), r2 = fetch4(splats, 3u * s + 2u);
            e = ellipse(u, r0.xy, r2.zw, vec3(r0.zw, r1.x), r1.y);
        }
    }
    emit(u, t, e);
#ifdef SWEEP
    barrier();
    add_bins(lane, ORDERED_LANES);
#endif
}
