//! Exclusive prefix sum of u32 values by reduce-then-scan. Workgroups never wait, so it runs on any device.

use super::build::{Builder, Count, ONE};
use crate::pass::build::pass;
use crate::scheduler::plan::{Buf, Grid};

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

/// Writes `offsets[i]` = sum of `values[..i]`, and the sum of all values to the counter `total`.
pub fn scan(b: &mut Builder, values: Buf, offsets: Buf, count: Count, total: Total) {
    reduce_then_scan(b, (values, offsets), count, total, false);
}

/// Same as [`scan`]; each key other than `KEY_INVISIBLE` counts as 1.
pub fn scan_visible(b: &mut Builder, keys: Buf, offsets: Buf) {
    reduce_then_scan(b, (keys, offsets), Count::Gaussians, Total::Visible, true);
}

fn reduce_then_scan(b: &mut Builder, (values, offsets): (Buf, Buf), count: Count, total: Total, flag: bool) {
    let lanes = b.capacity.scan_lanes as u32;
    let groups = Grid::Groups(lanes / b.shape.subgroup, 1, 1);
    pass!(b, scan_reduce(flag: flag) {
        step: Buf::STEP, counters: Buf::COUNTERS, failure: Buf::FAILURE, values: values, partials: Buf::SCAN_PARTIALS,
    } [count_source: count as u32, lanes: lanes], groups);
    pass!(b, scan_spine { partials: Buf::SCAN_PARTIALS, counters: Buf::COUNTERS }
        [lanes: lanes, total: total as u32], ONE);
    pass!(b, scan_apply(flag: flag) {
        step: Buf::STEP, counters: Buf::COUNTERS, failure: Buf::FAILURE, values: values, partials: Buf::SCAN_PARTIALS,
        offsets: offsets,
    } [count_source: count as u32, lanes: lanes], groups);
}
