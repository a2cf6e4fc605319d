//! Labels from masks: the lift of a step, whose votes `blend_forward_labels` casts, and the votes of whole sweeps.

use super::build::{Builder, args, over_gaussians};
use super::project::GAUSSIAN_FROM_SPLAT;
use crate::pass;
use crate::scheduler::plan::Buf;
use crate::shaders::constants;

/// The highest vote of this step becomes the label of its Gaussian.
pub fn resolve(b: &mut Builder) {
    pass!(b, lift_resolve {
        step: Buf::STEP, failure: Buf::FAILURE, label_keys: Buf::LABEL_KEYS, labels: Buf::LABELS,
    } [], over_gaussians());
}

/// Adds the weights of all contributors to the votes for the labels of their pixels.
pub fn vote(b: &mut Builder, slots: Buf, rounds: u32) {
    let (subgroup, tile_width, tile_height) = (b.shape.subgroup, b.shape.tile_width, b.shape.tile_height);
    let (segments, length) = (b.capacity.segments as u32, b.shape.segment_length);
    for round in 0..rounds {
        if segments == 1 {
            pass!(b, texel vote {
                step: Buf::STEP, tile_starts: Buf::TILE_STARTS, tile_ends: Buf::TILE_ENDS,
                slots: slots, splat_from_instance: Buf::SPLAT_FROM_INSTANCE, splats: Buf::SPLATS, gaussian_from_splat: GAUSSIAN_FROM_SPLAT,
                view_labels: Buf::VIEW_LABELS, vote_weights: Buf::VOTE_WEIGHTS, votes_low: Buf::VOTES_LOW,
                votes_high: Buf::VOTES_HIGH,
            } [subgroup_size: subgroup, tile_width: tile_width, tile_height: tile_height, round: round],
                args(constants::ARGS_BLEND));
            continue;
        }
        for segment in 0..segments {
            pass!(b, texel vote_segmented {
                step: Buf::STEP, tile_starts: Buf::TILE_STARTS, tile_ends: Buf::TILE_ENDS,
                slots: slots, splat_from_instance: Buf::SPLAT_FROM_INSTANCE, splats: Buf::SPLATS, gaussian_from_splat: GAUSSIAN_FROM_SPLAT,
                view_labels: Buf::VIEW_LABELS, vote_weights: Buf::VOTE_WEIGHTS, votes_low: Buf::VOTES_LOW,
                votes_high: Buf::VOTES_HIGH, segment_colours: Buf::SEGMENT_COLOURS,
            } [subgroup_size: subgroup, tile_width: tile_width, tile_height: tile_height, round: round,
                segment: segment, segments: segments, segment_length: length], args(constants::ARGS_BLEND));
        }
    }
}
