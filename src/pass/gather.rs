//! Sum of the gradient records of each splat; no atomics, so every run gives the same bits.

use super::build::{Builder, over_splats};
use super::project::GAUSSIAN_FROM_SPLAT;
use crate::pass;
use crate::scheduler::plan::Buf;

/// Adds up the records and notes the densification statistic.
pub fn gather(b: &mut Builder) {
    if b.labels {
        pass!(b, texel gather_labels {
            step: Buf::STEP, counters: Buf::COUNTERS, failure: Buf::FAILURE, tiles_touched: Buf::TILES_TOUCHED,
            instance_offsets: Buf::INSTANCE_OFFSETS, v_instances_a: Buf::V_INSTANCES_A, v_instances_b: Buf::V_INSTANCES_B, v_instances_c: Buf::V_INSTANCES_C,
            gaussian_from_splat: GAUSSIAN_FROM_SPLAT, v_splats: Buf::V_SPLATS, densify_stats: Buf::DENSIFY_STATS,
            labels: Buf::LABELS, layer_from_label: Buf::LAYER_FROM_LABEL,
        } [], over_splats());
    } else {
        pass!(b, texel gather {
            step: Buf::STEP, counters: Buf::COUNTERS, failure: Buf::FAILURE, tiles_touched: Buf::TILES_TOUCHED,
            instance_offsets: Buf::INSTANCE_OFFSETS, v_instances_a: Buf::V_INSTANCES_A, v_instances_b: Buf::V_INSTANCES_B, v_instances_c: Buf::V_INSTANCES_C,
            gaussian_from_splat: GAUSSIAN_FROM_SPLAT, v_splats: Buf::V_SPLATS, densify_stats: Buf::DENSIFY_STATS,
        } [], over_splats());
    }
}
