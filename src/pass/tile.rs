//! Bins splats: lists the splats of each tile, front to back, for the scene and for each object layer.

use super::build::{Builder, Count, args, over_splats};
use super::project::GAUSSIAN_FROM_SPLAT;
use super::scan::{self, Total};
use super::sort::{self, SortBuffers};
use crate::pass::build::pass;
use crate::scheduler::plan::{Buf, Stage};
use crate::shaders::constants;

/// Lists the (splat, tile) pairs, sorts them by layer and tile, and finds each tile's range. Returns the buffer with
/// each sorted pair's position before the sort.
pub(super) fn bin_splats(b: &mut Builder) -> Buf {
    b.list.stage = Stage::TILE;
    let bits = 64 - b.capacity.virtual_tiles.saturating_sub(1).leading_zeros();
    let (sweep, sort_slot) = (b.shape.sweeps(), b.sweeps.sorts);
    pass!(b, emit_instances(labels: b.supervision.has_layers(), group: b.shape.group_walks, sweep: sweep) {
        step: Buf::STEP, counters: Buf::COUNTERS, failure: Buf::FAILURE, splats: Buf::SPLATS,
        tiles_touched: Buf::TILES_TOUCHED, instance_offsets: Buf::INSTANCE_OFFSETS, tile_keys: Buf::TILE_KEYS_A,
        splat_from_instance: Buf::SPLAT_FROM_INSTANCE, gaussian_from_splat: GAUSSIAN_FROM_SPLAT,
        labels: Buf::LABELS, layer_from_label: Buf::LAYER_FROM_LABEL, sweep: Buf::SWEEP,
    } [sort_slot: sort_slot, key_bits: bits.max(1)], over_splats());
    let buffers =
        SortBuffers { keys: [Buf::TILE_KEYS_A, Buf::TILE_KEYS_B], values: [Buf::TILE_VALUES_A, Buf::TILE_VALUES_B] };
    let (keys, pairs) = sort::sort(b, buffers, bits, Count::Instances, "by tile", true);
    tile_ranges(b, keys);
    pairs
}

fn tile_ranges(b: &mut Builder, keys: Buf) {
    let groups = args(constants::ARGS_TILES);
    pass!(b, tile_ranges(labels: b.supervision.has_layers(), parts: b.long_list.is_some()) {
        step: Buf::STEP, failure: Buf::FAILURE, counters: Buf::COUNTERS, tile_keys: keys,
        tile_starts: Buf::TILE_STARTS, tile_ends: Buf::TILE_ENDS, layer_occupied: Buf::LAYER_OCCUPIED,
        long_chunks: Buf::LONG_CHUNKS, first_lists: Buf::FIRST_LISTS, dispatch_args: Buf::DISPATCH_ARGS,
    } [long_list: b.long_list.unwrap_or(u32::MAX)], groups);
    if !b.supervision.has_layers() {
        return;
    }
    if b.shape.sweeps() {
        return scan::list_by_sweep(b, Buf::LAYER_OCCUPIED, Buf::LAYER_TILES);
    }
    scan::scan(b, Buf::LAYER_OCCUPIED, Buf::LAYER_OFFSETS, Count::VirtualTiles, Total::LayerTiles);
    pass!(b, layer_list {
        step: Buf::STEP, failure: Buf::FAILURE, layer_occupied: Buf::LAYER_OCCUPIED,
        layer_offsets: Buf::LAYER_OFFSETS, layer_tiles: Buf::LAYER_TILES,
    } [], groups);
}
