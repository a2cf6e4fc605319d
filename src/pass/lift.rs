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
    pass!(b, lift_resolve {} [], over_gaussians());
}

/// Finds the label with the largest sum of weights in each pixel. Each tile is processed up to `rounds` times, for four
/// labels each.
pub(super) fn label_map(b: &mut Builder, pairs: Buf, rounds: u32) {
    let segments = b.segments();
    b.list.stage = Stage::LABELS;
    for (round, segment) in (0..rounds).flat_map(|round| (0..segments).map(move |segment| (round, segment))) {
        pass!(b, label_map(segmented: segments > 1)
            { instance_from_sorted: pairs, gaussian_from_splat: GAUSSIAN_FROM_SPLAT }
                [later: u32::from(round > 0), walk: round, walks: rounds, segment: segment, segments: segments],
            args(constants::ARGS_BLEND));
    }
}

/// Adds the weight of every contributor to the votes for its pixel's label. With `alone`, it adds alpha and ignores
/// occlusion.
pub(super) fn vote(b: &mut Builder, pairs: Buf, rounds: u32, alone: bool) {
    let segments = b.segments();
    b.list.stage = Stage::LABELS;
    for (round, segment) in (0..rounds).flat_map(|round| (0..segments).map(move |segment| (round, segment))) {
        pass!(b, vote(segmented: segments > 1)
            { instance_from_sorted: pairs, gaussian_from_splat: GAUSSIAN_FROM_SPLAT }
                [walk: round, alone: alone.into(), segment: segment], args(constants::ARGS_BLEND));
    }
}
