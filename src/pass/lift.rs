//! Labels from masks: the lift of a step (`blend_forward_labels` casts its votes), and vote sweeps over all views. Also
//! renders the label map of a view.

use super::build::{Builder, args, over_gaussians};
use super::project::GAUSSIAN_FROM_SPLAT;
use crate::pass::build::pass;
use crate::scheduler::plan::{Buf, Stage};
use crate::shaders::constants;

/// Gives each Gaussian the label with the highest vote of this step.
pub(super) fn resolve(b: &mut Builder) {
    b.list.stage = Stage::LABELS;
    pass!(b, lift_resolve {
        step: Buf::STEP, counters: Buf::COUNTERS, label_keys: Buf::LABEL_KEYS, labels: Buf::LABELS,
    } [], over_gaussians());
}

/// Finds the label with the largest sum of weights in each pixel. Each tile is processed up to `rounds` times, for four
/// labels each.
pub(super) fn label_map(b: &mut Builder, pairs: Buf, rounds: u32) {
    let segments = b.segments();
    b.list.stage = Stage::LABELS;
    for (round, segment) in (0..rounds).flat_map(|round| (0..segments).map(move |segment| (round, segment))) {
        pass!(b, label_map(segmented: segments > 1) {
            step: Buf::STEP, counters: Buf::COUNTERS, tile_starts: Buf::TILE_STARTS, tile_ends: Buf::TILE_ENDS,
            instance_from_sorted: pairs, splat_from_instance: Buf::SPLAT_FROM_INSTANCE, splats: Buf::SPLATS,
            gaussian_from_splat: GAUSSIAN_FROM_SPLAT, labels: Buf::LABELS, label_map: Buf::LABEL_MAP,
            label_weights: Buf::LABEL_WEIGHTS, label_tables: Buf::LABEL_TABLES, segment_colours: Buf::SEGMENT_COLOURS,
            segment_rest: Buf::SEGMENT_REST,
        } [later: u32::from(round > 0), walk: round, walks: rounds, segment: segment, segments: segments],
            args(constants::ARGS_BLEND));
    }
}

/// Adds the weight of every contributor to the votes for its pixel's label. With `alone`, it adds alpha and ignores
/// occlusion.
pub(super) fn vote(b: &mut Builder, pairs: Buf, rounds: u32, alone: bool) {
    let segments = b.segments();
    b.list.stage = Stage::LABELS;
    for (round, segment) in (0..rounds).flat_map(|round| (0..segments).map(move |segment| (round, segment))) {
        pass!(b, vote(segmented: segments > 1) {
            step: Buf::STEP, tile_starts: Buf::TILE_STARTS, tile_ends: Buf::TILE_ENDS,
            instance_from_sorted: pairs, splat_from_instance: Buf::SPLAT_FROM_INSTANCE, splats: Buf::SPLATS,
            gaussian_from_splat: GAUSSIAN_FROM_SPLAT, view_labels: Buf::VIEW_LABELS, vote_weights: Buf::VOTE_WEIGHTS,
            votes_low: Buf::VOTES_LOW, votes_high: Buf::VOTES_HIGH, segment_colours: Buf::SEGMENT_COLOURS,
        } [walk: round, alone: alone.into(), segment: segment], args(constants::ARGS_BLEND));
    }
}
