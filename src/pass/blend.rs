//! Blends the tiles, forward and backward. Lists that are too long for one dispatch are processed in segments.

use super::Supervision;
use super::build::{Builder, args};
use super::project::GAUSSIAN_FROM_SPLAT;
use crate::pass::build::pass;
use crate::scheduler::plan::{Buf, Stage};
use crate::shaders::constants;

/// Blends all tiles front to back. With object layers, it also blends these, with their loss and the label lift.
pub(super) fn blend_forward(b: &mut Builder, pairs: Buf) {
    forward(b, pairs, false);
}

/// Blends all tiles of the scene; writes the main Gaussian of each pixel, its weight, and the depth.
pub(super) fn blend_forward_main(b: &mut Builder, pairs: Buf) {
    forward(b, pairs, true);
}

/// Returns the list length beyond which the forward pass works in parts; [`u32::MAX`] if no list is longer, or if a
/// lift needs each pixel's main splat, which parts do not record.
pub(super) fn long_list(b: &Builder) -> Option<u32> {
    let length = b.shape.group_blend?.long_list;
    let has_some = !b.supervision.lifts() && b.capacity.gaussians > u64::from(length);
    Some(if has_some { length } else { u32::MAX })
}

/// A workgroup per list, or per chunk of a long list. With `products`, it finds what each such chunk lets through.
fn group_forward(b: &mut Builder, pairs: Buf, main: bool, products: bool) {
    let (walks, supervision) = (!products, b.supervision);
    let (labels, (disagreement, depth)) = (walks && supervision.has_layers(), channels(supervision));
    let group_lanes = b.shape.group_blend.map_or(0, |blend| b.shape.tile_pixels() / blend.forward_rows);
    pass!(b, group_forward(labels: labels, main: main, disagreement: walks && disagreement, depth: walks && depth,
        products: products) { instance_from_sorted: pairs, gaussian_from_splat: GAUSSIAN_FROM_SPLAT }
            [lift: supervision.lifts().into(), counts: b.counts.into(), group_lanes: group_lanes,
        long_list: b.long_list.unwrap_or(u32::MAX)],
        args(if products { constants::ARGS_PRODUCTS } else { constants::ARGS_WALK }));
}

fn forward(b: &mut Builder, pairs: Buf, main: bool) {
    b.list.stage = Stage::BLEND_FORWARD;
    if b.shape.group_blend.is_some() {
        if b.long_list.is_some_and(|length| length < u32::MAX) {
            group_forward(b, pairs, false, true);
        }
        return group_forward(b, pairs, main, false);
    }
    let (segments, counts) = (b.segments(), b.counts);
    let (labels, lift) = (b.supervision.has_layers(), b.supervision.lifts());
    for segment in 0..segments {
        pass!(b, blend_forward(labels: labels, main: main, segmented: segments > 1)
            { instance_from_sorted: pairs, gaussian_from_splat: GAUSSIAN_FROM_SPLAT }
                [lift: lift.into(), counts: counts.into(), segment: segment, segments: segments],
            args(constants::ARGS_BLEND));
    }
}

/// Processes all tiles back to front and writes one gradient record per (splat, tile) pair.
pub(super) fn blend_backward(b: &mut Builder, pairs: Buf) {
    let (segments, supervision) = (b.segments(), b.supervision);
    let labels = supervision.has_layers();
    let (disagreement, depth) = channels(supervision);
    b.list.stage = Stage::BLEND_BACKWARD;
    if let Some(blend) = b.shape.group_blend {
        pass!(b, group_backward(labels: labels, disagreement: disagreement, depth: depth)
            { instance_from_sorted: pairs, gaussian_from_splat: GAUSSIAN_FROM_SPLAT }
                [group_lanes: b.shape.tile_pixels() / blend.backward_rows], args(constants::ARGS_CHUNKS));
        return;
    }
    for segment in (0..segments).rev() {
        pass!(b, blend_backward(labels: labels, disagreement: disagreement, depth: depth, segmented: segments > 1)
            { instance_from_sorted: pairs, gaussian_from_splat: GAUSSIAN_FROM_SPLAT }
                [segment: segment, segments: segments], args(constants::ARGS_BLEND));
    }
}

/// Returns whether the scene's blend pass has labels or known depths as a channel.
fn channels(supervision: Supervision) -> (bool, bool) {
    (supervision == Supervision::Disagreement, supervision == Supervision::Depth)
}
