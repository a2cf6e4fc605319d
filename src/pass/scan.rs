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
    if !b.shape.sweeps() {
        return reduce_then_scan(b, (values, offsets), count, total, false);
    }
    let slot = b.next_scan();
    pass!(b, scan_sweep {
        step: Buf::STEP, counters: Buf::COUNTERS, failure: Buf::FAILURE, values: values, sweep: Buf::SWEEP,
        offsets: offsets, keys_out: offsets, values_out: offsets,
    } [count_source: count as u32, total: total as u32, sweep_slot: slot], count.partitions());
}

/// Writes the visible keys and their Gaussians, in the order of the model, and the number of them to `visible_count`, in one
/// pass; and the histograms for a sort of these keys by the next passes.
pub fn compact_by_sweep(b: &mut Builder, keys: Buf, (keys_out, values_out): (Buf, Buf)) {
    let (slot, sort_slot) = (b.next_scan(), b.sweeps.sorts);
    pass!(b, scan_sweep(compact: true) {
        step: Buf::STEP, counters: Buf::COUNTERS, failure: Buf::FAILURE, values: keys, sweep: Buf::SWEEP,
        keys_out: keys_out, values_out: values_out, offsets: keys_out,
    } [count_source: Count::Gaussians as u32, total: Total::Visible as u32, sweep_slot: slot, sort_slot: sort_slot],
        Count::Gaussians.partitions());
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
