//! Bins splats: lists the splats of each tile, front to back, for the scene and for each object layer.

use super::build::{Builder, Count, args, over_splats};
use super::project::GAUSSIAN_FROM_SPLAT;
use super::scan::{self, Total};
use super::sort::{self, SortBuffers};
use crate::pass::KernelShape;
use crate::pass::buffers::Capacity;
use crate::pass::build::pass;
use crate::scheduler::plan::{Buf, Stage};
use crate::shaders::constants;

/// The sort of the (splat, tile) pairs in a pass list.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TileSort {
    /// Bits of the keys.
    pub bits: u32,
    /// The pairs before the sort are in the first buffers.
    pub buffers: SortBuffers,
}

impl TileSort {
    /// Makes the sort for the scene's tiles, and for object layers if the list has them. Without look-back passes, the
    /// keys always include the layer digits.
    pub(crate) fn new(shape: &KernelShape, capacity: &Capacity, layers: bool) -> Self {
        let tiles = if layers || !shape.sweeps() { capacity.virtual_tiles } else { capacity.tiles() };
        let buffers = SortBuffers {
            keys: [Buf::TILE_KEYS_A, Buf::TILE_KEYS_B],
            values: [Buf::TILE_VALUES_A, Buf::TILE_VALUES_B],
            narrow: shape.has_narrow_keys(tiles),
        };
        Self { bits: 64 - tiles.saturating_sub(1).leading_zeros(), buffers }
    }
}

/// Lists the (splat, tile) pairs, sorts them by layer and tile, and finds each tile's range. Returns the buffer with
/// each sorted pair's position before the sort.
pub(super) fn bin_splats(b: &mut Builder) -> Buf {
    b.list.stage = Stage::TILE;
    let labels = b.supervision.has_layers();
    let TileSort { bits, buffers } = TileSort::new(b.shape, b.capacity, labels);
    let narrow = buffers.narrow;
    if b.shape.group_walks {
        let (sweep, sort_pass) = (b.shape.sweeps(), b.sort_passes);
        let look_first = b.next_look(b.capacity.gaussians);
        pass!(b, emit_ordered(labels: labels, sweep: sweep, narrow: narrow) { tile_keys: buffers.keys[0], gaussian_from_splat: GAUSSIAN_FROM_SPLAT, order: Buf::DEPTH_ORDER } [sort_pass: sort_pass, look_first: look_first, key_bits: bits.max(1),
            digit_bits: sort::digit_bits(b.shape, bits)], over_splats());
    } else {
        pass!(b, emit_instances(labels: labels) { tile_keys: buffers.keys[0], gaussian_from_splat: GAUSSIAN_FROM_SPLAT } [], over_splats());
    }
    let (keys, pairs) = sort::sort(b, buffers, bits, Count::Instances, "by tile", true);
    tile_ranges(b, keys, if narrow { 2 } else { 1 });
    pairs
}

fn tile_ranges(b: &mut Builder, keys: Buf, keys_per_word: u32) {
    let groups = args(constants::ARGS_TILES);
    pass!(b, tile_ranges(labels: b.supervision.has_layers(), parts: b.long_list.is_some()) { tile_keys: keys } [keys_per_word: keys_per_word, long_list: b.long_list.unwrap_or(u32::MAX)], groups);
    if !b.supervision.has_layers() {
        return;
    }
    if b.shape.group_walks {
        return scan::list(b, Buf::LAYER_OCCUPIED, Buf::LAYER_TILES);
    }
    scan::scan(b, Buf::LAYER_OCCUPIED, Buf::LAYER_OFFSETS, Count::VirtualTiles, Total::LayerTiles);
    pass!(b, layer_list {} [], groups);
}
