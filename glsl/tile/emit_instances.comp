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
// Work:    64 splats per workgroup. A splat's instances are contiguous: first those of the scene layer, then
//          those of its object layer; keys are layer * tile_count + tile. Variant group: rows and tiles are shared out.
// Reads:   step, counters, failure; splats [V,3]; tiles_touched [V]; instance_offsets [V];
//          variant labels: gaussian_from_splat [V], labels [N], layer_from_label
// Writes:  tile_keys [I] (variant narrow: of 16 bits); splat_from_instance [I]; variant sweep: sweep (histograms of the digits of the keys)
// Mirror:  src/reference/tile.rs::emit_instances, tile.rs::row_interval

layout(local_size_x = 64) in;
READ1(0, StepUniforms, step);
READ1(1, Counters, counters);
READ1(2, uint, failure);
FETCH4(3, splats);
FETCHU(4, tiles_touched);
FETCHU(5, instance_offsets);
WRITE(6, KEY, tile_keys);
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

#ifdef GROUP
#include "rows.glsl"
#endif

// Where the instances of a splat go.
struct Target {
    uint splat, layer;
    uint first; // instance
    uint count; // tiles
};

void put(uint at, uint key, uint splat) {
    tile_keys[at] = KEY(key);
    splat_from_instance[at] = splat;
#ifdef SWEEP
    count_digits(key);
#endif
}

// Writes the instances of a splat's n-th tile.
void put_tile(StepUniforms u, Target t, uint n, uint tile) {
    if (n < t.count) {
        put(t.first + n, tile, t.splat);
#ifdef LABELS
        if (t.layer != 0u) {
            put(t.first + t.count + n, t.layer * u.tile_count + tile, t.splat);
        }
#endif
    }
}

#ifdef GROUP
shared Target targets[WALKERS];
shared uint tiles_before[WALKERS]; // of the splats before
shared uvec2 row_tiles[WALKERS];   // of a row: first tile, splat

// Rows of tiles by invocation, 64 at a time; then their tiles by invocation, so that neighbours write to neighbouring places.
void emit(StepUniforms u, Target t, Ellipse e) {
    uint lane = gl_LocalInvocationID.x, written = 0u;
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
#else
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
#endif

void main() {
    StepUniforms u = step;
    uint s = linear_group_id() * 64u + gl_LocalInvocationID.x;
#ifdef SWEEP
    clear_bins(gl_LocalInvocationID.x, 64u);
    barrier();
#endif
    Target t = Target(s, 0u, 0u, 0u);
    Ellipse e;
    e.rows = 0u;
    if (s < counters.visible_count && failure == 0u) {
#ifdef LABELS
        t.layer = fetchu(layer_from_label, fetchu(labels, fetchu(gaussian_from_splat, s)));
#endif
        t.first = fetchu(instance_offsets, s);
        t.count = fetchu(tiles_touched, s) / (t.layer != 0u ? 2u : 1u);
        if (t.count > 0u) {
            vec4 r0 = fetch4(splats, 3u * s), r1 = fetch4(splats, 3u * s + 1u), r2 = fetch4(splats, 3u * s + 2u);
            e = ellipse(u, r0.xy, r2.zw, vec3(r0.zw, r1.x), r1.y);
        }
    }
    emit(u, t, e);
#ifdef SWEEP
    barrier();
    add_bins(gl_LocalInvocationID.x, 64u);
#endif
}
