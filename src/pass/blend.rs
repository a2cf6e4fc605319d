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
        products: products) {
        step: Buf::STEP, counters: Buf::COUNTERS, tile_starts: Buf::TILE_STARTS, tile_ends: Buf::TILE_ENDS,
        instance_from_sorted: pairs, splat_from_instance: Buf::SPLAT_FROM_INSTANCE, splats: Buf::SPLATS,
        image: Buf::IMAGE, last: Buf::LAST, gaussian_from_splat: GAUSSIAN_FROM_SPLAT,
        main_gaussian: Buf::MAIN_GAUSSIAN,
        main_weight_depth: Buf::MAIN_WEIGHT_DEPTH, layer_tiles: Buf::LAYER_TILES, target: Buf::TARGET,
        view_labels: Buf::VIEW_LABELS, layer_occluders: Buf::LAYER_OCCLUDERS,
        label_from_layer: Buf::LABEL_FROM_LAYER, layer_state: Buf::LAYER_STATE, layer_loss: Buf::LAYER_LOSS,
        label_keys: Buf::LABEL_KEYS, layer_from_label: Buf::LAYER_FROM_LABEL, layer_weights: Buf::LAYER_WEIGHTS,
        labels: Buf::LABELS, disagreement: Buf::DISAGREEMENT, depths: Buf::DEPTHS,
        chunk_jobs: Buf::CHUNK_JOBS, chunk_states: Buf::CHUNK_STATES, chunk_channel: Buf::CHUNK_CHANNEL,
        long_chunks: Buf::LONG_CHUNKS, first_lists: Buf::FIRST_LISTS,
    } [lift: supervision.lifts().into(), counts: b.counts.into(), group_lanes: group_lanes,
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
        pass!(b, blend_forward(labels: labels, main: main, segmented: segments > 1) {
            step: Buf::STEP, counters: Buf::COUNTERS, tile_starts: Buf::TILE_STARTS, tile_ends: Buf::TILE_ENDS,
            instance_from_sorted: pairs, splat_from_instance: Buf::SPLAT_FROM_INSTANCE, splats: Buf::SPLATS,
            image: Buf::IMAGE, last: Buf::LAST, gaussian_from_splat: GAUSSIAN_FROM_SPLAT,
            main_gaussian: Buf::MAIN_GAUSSIAN,
            main_weight_depth: Buf::MAIN_WEIGHT_DEPTH, layer_tiles: Buf::LAYER_TILES, target: Buf::TARGET,
            view_labels: Buf::VIEW_LABELS, layer_occluders: Buf::LAYER_OCCLUDERS,
            label_from_layer: Buf::LABEL_FROM_LAYER, layer_state: Buf::LAYER_STATE, layer_loss: Buf::LAYER_LOSS,
            label_keys: Buf::LABEL_KEYS, layer_from_label: Buf::LAYER_FROM_LABEL, layer_weights: Buf::LAYER_WEIGHTS,
            segment_colours: Buf::SEGMENT_COLOURS, segment_rest: Buf::SEGMENT_REST,
        } [lift: lift.into(), counts: counts.into(), segment: segment, segments: segments],
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
        pass!(b, group_backward(labels: labels, disagreement: disagreement, depth: depth) {
            step: Buf::STEP, tile_starts: Buf::TILE_STARTS, instance_from_sorted: pairs,
            splat_from_instance: Buf::SPLAT_FROM_INSTANCE, splats: Buf::SPLATS, image: Buf::IMAGE, last: Buf::LAST,
            v_image: Buf::V_IMAGE,
            v_instances_a: Buf::V_INSTANCES_A, v_instances_b: Buf::V_INSTANCES_B, v_instances_c: Buf::V_INSTANCES_C,
            counters: Buf::COUNTERS, chunk_jobs: Buf::CHUNK_JOBS, chunk_states: Buf::CHUNK_STATES,
            layer_tiles: Buf::LAYER_TILES, layer_state: Buf::LAYER_STATE, layer_weights: Buf::LAYER_WEIGHTS,
            target: Buf::TARGET, view_labels: Buf::VIEW_LABELS, labels: Buf::LABELS,
            gaussian_from_splat: GAUSSIAN_FROM_SPLAT, depths: Buf::DEPTHS, chunk_channel: Buf::CHUNK_CHANNEL,
        } [group_lanes: b.shape.tile_pixels() / blend.backward_rows], args(constants::ARGS_CHUNKS));
        return;
    }
    for segment in (0..segments).rev() {
        pass!(b, blend_backward(labels: labels, disagreement: disagreement, depth: depth, segmented: segments > 1) {
            step: Buf::STEP, tile_starts: Buf::TILE_STARTS, instance_from_sorted: pairs,
            splat_from_instance: Buf::SPLAT_FROM_INSTANCE, splats: Buf::SPLATS, image: Buf::IMAGE, last: Buf::LAST,
            v_image: Buf::V_IMAGE,
            v_instances_a: Buf::V_INSTANCES_A, v_instances_b: Buf::V_INSTANCES_B, v_instances_c: Buf::V_INSTANCES_C,
            counters: Buf::COUNTERS, layer_tiles: Buf::LAYER_TILES, layer_state: Buf::LAYER_STATE,
            layer_weights: Buf::LAYER_WEIGHTS, segment_back: Buf::SEGMENT_BACK, target: Buf::TARGET,
            view_labels: Buf::VIEW_LABELS, labels: Buf::LABELS, gaussian_from_splat: GAUSSIAN_FROM_SPLAT,
            disagreement: Buf::DISAGREEMENT, segment_rest: Buf::SEGMENT_REST,
            depths: Buf::DEPTHS,
        } [segment: segment, segments: segments], args(constants::ARGS_BLEND));
    }
}

/// Returns whether the scene's blend pass has labels or known depths as a channel.
fn channels(supervision: Supervision) -> (bool, bool) {
    (supervision == Supervision::Disagreement, supervision == Supervision::Depth)
}
