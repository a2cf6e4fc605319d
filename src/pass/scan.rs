//! Exclusive scan of u32 values, reduce-then-scan: no waiting between workgroups, so it runs on any device.

use super::build::{Builder, Count, ONE};
use crate::pass;
use crate::scheduler::plan::{Buf, Grid};

/// Which counter the total goes to.
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

/// `offsets[i]` = sum of `values[..i]`; the sum of all goes to a counter.
pub fn scan(b: &mut Builder, values: Buf, offsets: Buf, count: Count, total: Total) {
    let (lanes, source) = (lanes(b), count as u32);
    let groups = Grid::Groups(lanes / b.shape.subgroup, 1, 1);
    let subgroup = b.shape.subgroup;
    pass!(b, texel scan_reduce {
        step: Buf::STEP, counters: Buf::COUNTERS, failure: Buf::FAILURE, values: values, partials: Buf::SCAN_PARTIALS,
    } [subgroup_size: subgroup, count_source: source, lanes: lanes], groups);
    spine(b, lanes, total);
    pass!(b, texel scan_apply {
        step: Buf::STEP, counters: Buf::COUNTERS, failure: Buf::FAILURE, values: values, partials: Buf::SCAN_PARTIALS,
        offsets: offsets,
    } [subgroup_size: subgroup, count_source: source, lanes: lanes], groups);
}

/// As [`scan`], each key that is not `KEY_INVISIBLE` counting as 1.
pub fn scan_visible(b: &mut Builder, keys: Buf, offsets: Buf) {
    let (lanes, source) = (lanes(b), Count::Gaussians as u32);
    let groups = Grid::Groups(lanes / b.shape.subgroup, 1, 1);
    let subgroup = b.shape.subgroup;
    pass!(b, texel scan_reduce_flag {
        step: Buf::STEP, counters: Buf::COUNTERS, failure: Buf::FAILURE, values: keys, partials: Buf::SCAN_PARTIALS,
    } [subgroup_size: subgroup, count_source: source, lanes: lanes], groups);
    spine(b, lanes, Total::Visible);
    pass!(b, texel scan_apply_flag {
        step: Buf::STEP, counters: Buf::COUNTERS, failure: Buf::FAILURE, values: keys, partials: Buf::SCAN_PARTIALS,
        offsets: offsets,
    } [subgroup_size: subgroup, count_source: source, lanes: lanes], groups);
}

fn spine(b: &mut Builder, lanes: u32, total: Total) {
    let subgroup = b.shape.subgroup;
    pass!(b, scan_spine { partials: Buf::SCAN_PARTIALS, counters: Buf::COUNTERS }
        [subgroup_size: subgroup, lanes: lanes, total: total as u32], ONE);
}

fn lanes(b: &Builder) -> u32 {
    b.capacity.scan_lanes as u32
}
