//! Sums the gradient records of each splat without atomics, so that every run gives the same bits.

use super::build::{Builder, over_splats};
use super::project::GAUSSIAN_FROM_SPLAT;
use crate::pass::build::pass;
use crate::scheduler::plan::{Buf, Stage};

/// Sums the records and updates the densification statistic.
pub(super) fn gather(b: &mut Builder) {
    b.list.stage = Stage::GATHER;
    pass!(b, gather(labels: b.supervision.has_layers(), group: b.shape.group_walks) {
        step: Buf::STEP, counters: Buf::COUNTERS, tiles_touched: Buf::TILES_TOUCHED,
        instance_offsets: Buf::INSTANCE_OFFSETS, v_instances_a: Buf::V_INSTANCES_A, v_instances_b: Buf::V_INSTANCES_B,
        v_instances_c: Buf::V_INSTANCES_C, gaussian_from_splat: GAUSSIAN_FROM_SPLAT, v_splats: Buf::V_SPLATS,
        densify_stats: Buf::DENSIFY_STATS, labels: Buf::LABELS, layer_from_label: Buf::LAYER_FROM_LABEL,
    } [], over_splats());
}

/// Adds the blending weights of the view to those of the Gaussians, if every pixel has a gradient of 1.
pub(super) fn weigh(b: &mut Builder) {
    b.list.stage = Stage::GATHER;
    pass!(b, weigh {
        step: Buf::STEP, counters: Buf::COUNTERS, tiles_touched: Buf::TILES_TOUCHED,
        instance_offsets: Buf::INSTANCE_OFFSETS, gaussian_from_splat: GAUSSIAN_FROM_SPLAT,
        v_instances_b: Buf::V_INSTANCES_B, v_instances_c: Buf::V_INSTANCES_C, densify_stats: Buf::DENSIFY_STATS,
    } [], over_splats());
}
