//! Exclusive prefix sum of u32 values: by reduce-then-scan, or in one dispatch that looks back.

use super::build::{Builder, Count, ONE_GROUP, args, over_gaussians};
use crate::pass::build::pass;
use crate::scheduler::plan::{Buf, Grid};
use crate::shaders::constants;

/// The counter that receives the total.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Total {
    /// `visible_count`.
    Visible = 0,
    /// `instance_count`.
    Instances = 1,
    /// `layer_tile_count`.
    LayerTiles = 2,
    /// `densified_count`.
    Densified = 3,
}

/// Writes `offsets[i]` = sum of `values[..i]`, the total to the counter `total`, and the dispatch sizes that depend on
/// it.
pub fn scan(b: &mut Builder, values: Buf, offsets: Buf, count: Count, total: Total) {
    if b.shape.group_walks {
        look_back(b, (values, offsets), count, total, false);
    } else {
        reduce_then_scan(b, (values, offsets), count, total, false);
    }
}

/// Writes the tiles with nonzero values, and their number to `layer_tile_count`, in one pass.
pub fn list(b: &mut Builder, occupied: Buf, tiles: Buf) {
    look_back(b, (occupied, tiles), Count::VirtualTiles, Total::LayerTiles, true);
}

fn look_back(b: &mut Builder, (values, out): (Buf, Buf), count: Count, total: Total, list: bool) {
    let (items, grid) = match count {
        Count::VirtualTiles => (b.capacity.virtual_tiles, args(constants::ARGS_TILES)),
        _ => (b.capacity.gaussians, over_gaussians()),
    };
    let first = b.next_look(items);
    pass!(b, scan_once(list: list) { values: values, offsets: out, layer_tiles: out } [count_source: count as u32, total: total as u32, look_first: first], grid);
}

/// Same as [`scan`], with each key other than `KEY_INVISIBLE` counting as 1.
pub fn scan_visible(b: &mut Builder, keys: Buf, offsets: Buf) {
    reduce_then_scan(b, (keys, offsets), Count::Gaussians, Total::Visible, true);
}

fn reduce_then_scan(b: &mut Builder, (values, offsets): (Buf, Buf), count: Count, total: Total, flag: bool) {
    let lanes = b.capacity.scan_lanes as u32;
    let groups = Grid::Groups(lanes / b.shape.subgroup, 1, 1);
    pass!(b, scan_reduce(flag: flag) { values: values, partials: Buf::SCAN_PARTIALS } [count_source: count as u32, lanes: lanes], groups);
    pass!(b, scan_spine { partials: Buf::SCAN_PARTIALS } [lanes: lanes, total: total as u32], ONE_GROUP);
    pass!(b, scan_apply(flag: flag) { values: values, partials: Buf::SCAN_PARTIALS, offsets: offsets } [count_source: count as u32, lanes: lanes], groups);
}
