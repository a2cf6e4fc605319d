//! Blending of the tiles, forward and backward. Lists that are too long for one dispatch are walked in segments.

use super::build::{Builder, args};
use super::project::GAUSSIAN_FROM_SPLAT;
use crate::pass;
use crate::scheduler::plan::{Buf, Grid};
use crate::shaders::constants;

const GRID: fn() -> Grid = || args(constants::ARGS_BLEND);

/// Blends all tiles front to back; with labels also the object layers and their loss, and the lift if it is asked for.
pub fn blend_forward(b: &mut Builder, slots: Buf, lift: bool) {
    let (subgroup, tile_width, tile_height) = (b.shape.subgroup, b.shape.tile_width, b.shape.tile_height);
    let (segments, length) = (b.capacity.segments as u32, b.shape.segment_length);
    let (lift, counts) = (u32::from(lift), u32::from(b.counts));
    if segments > 1 {
        for segment in 0..segments {
            if b.labels {
                pass!(b, texel blend_forward_labels_segmented {
                    step: Buf::STEP, counters: Buf::COUNTERS, tile_starts: Buf::TILE_STARTS, tile_ends: Buf::TILE_ENDS,
                    slots: slots, splat_from_instance: Buf::SPLAT_FROM_INSTANCE, splats: Buf::SPLATS, image: Buf::IMAGE, last: Buf::LAST,
                    layer_tiles: Buf::LAYER_TILES, target: Buf::TARGET, view_labels: Buf::VIEW_LABELS,
                    layer_occluders: Buf::LAYER_OCCLUDERS, label_from_layer: Buf::LABEL_FROM_LAYER,
                    gaussian_from_splat: GAUSSIAN_FROM_SPLAT, layer_state: Buf::LAYER_STATE, layer_loss: Buf::LAYER_LOSS,
                    label_keys: Buf::LABEL_KEYS, layer_from_label: Buf::LAYER_FROM_LABEL, layer_weights: Buf::LAYER_WEIGHTS,
                    segment_colours: Buf::SEGMENT_COLOURS, segment_rest: Buf::SEGMENT_REST,
                } [subgroup_size: subgroup, tile_width: tile_width, tile_height: tile_height, lift: lift, counts: counts,
                    segment: segment, segments: segments, segment_length: length], GRID());
            } else {
                pass!(b, texel blend_forward_segmented {
                    step: Buf::STEP, counters: Buf::COUNTERS, tile_starts: Buf::TILE_STARTS, tile_ends: Buf::TILE_ENDS,
                    slots: slots, splat_from_instance: Buf::SPLAT_FROM_INSTANCE, splats: Buf::SPLATS, image: Buf::IMAGE, last: Buf::LAST,
                    segment_colours: Buf::SEGMENT_COLOURS, segment_rest: Buf::SEGMENT_REST,
                } [subgroup_size: subgroup, tile_width: tile_width, tile_height: tile_height, counts: counts,
                    segment: segment, segments: segments, segment_length: length], GRID());
            }
        }
    } else if b.labels {
        pass!(b, texel blend_forward_labels {
            step: Buf::STEP, counters: Buf::COUNTERS, tile_starts: Buf::TILE_STARTS, tile_ends: Buf::TILE_ENDS,
            slots: slots, splat_from_instance: Buf::SPLAT_FROM_INSTANCE, splats: Buf::SPLATS, image: Buf::IMAGE, last: Buf::LAST,
            layer_tiles: Buf::LAYER_TILES, target: Buf::TARGET, view_labels: Buf::VIEW_LABELS,
            layer_occluders: Buf::LAYER_OCCLUDERS, label_from_layer: Buf::LABEL_FROM_LAYER,
            gaussian_from_splat: GAUSSIAN_FROM_SPLAT, layer_state: Buf::LAYER_STATE, layer_loss: Buf::LAYER_LOSS,
            label_keys: Buf::LABEL_KEYS, layer_from_label: Buf::LAYER_FROM_LABEL, layer_weights: Buf::LAYER_WEIGHTS,
        } [subgroup_size: subgroup, tile_width: tile_width, tile_height: tile_height, lift: lift, counts: counts], GRID());
    } else {
        pass!(b, texel blend_forward {
            step: Buf::STEP, counters: Buf::COUNTERS, tile_starts: Buf::TILE_STARTS, tile_ends: Buf::TILE_ENDS,
            slots: slots, splat_from_instance: Buf::SPLAT_FROM_INSTANCE, splats: Buf::SPLATS, image: Buf::IMAGE, last: Buf::LAST,
        } [subgroup_size: subgroup, tile_width: tile_width, tile_height: tile_height, counts: counts], GRID());
    }
}

/// Blends all tiles and keeps the main Gaussian of each pixel, its weight, and depth.
pub fn blend_forward_main(b: &mut Builder, slots: Buf) {
    let (subgroup, tile_width, tile_height) = (b.shape.subgroup, b.shape.tile_width, b.shape.tile_height);
    let (segments, length) = (b.capacity.segments as u32, b.shape.segment_length);
    if segments == 1 {
        pass!(b, texel blend_forward_main {
            step: Buf::STEP, counters: Buf::COUNTERS, tile_starts: Buf::TILE_STARTS, tile_ends: Buf::TILE_ENDS,
            slots: slots, splat_from_instance: Buf::SPLAT_FROM_INSTANCE, splats: Buf::SPLATS, image: Buf::IMAGE, last: Buf::LAST,
            main_gaussian: Buf::MAIN_GAUSSIAN, main_weight_depth: Buf::MAIN_WEIGHT_DEPTH,
            gaussian_from_splat: GAUSSIAN_FROM_SPLAT,
        } [subgroup_size: subgroup, tile_width: tile_width, tile_height: tile_height], GRID());
    } else {
        for segment in 0..segments {
            pass!(b, texel blend_forward_main_segmented {
                step: Buf::STEP, counters: Buf::COUNTERS, tile_starts: Buf::TILE_STARTS, tile_ends: Buf::TILE_ENDS,
                slots: slots, splat_from_instance: Buf::SPLAT_FROM_INSTANCE, splats: Buf::SPLATS, image: Buf::IMAGE, last: Buf::LAST,
                main_gaussian: Buf::MAIN_GAUSSIAN, main_weight_depth: Buf::MAIN_WEIGHT_DEPTH,
                gaussian_from_splat: GAUSSIAN_FROM_SPLAT,
                segment_colours: Buf::SEGMENT_COLOURS, segment_rest: Buf::SEGMENT_REST,
            } [subgroup_size: subgroup, tile_width: tile_width, tile_height: tile_height,
                segment: segment, segments: segments, segment_length: length], GRID());
        }
    }
}

/// Walks all tiles back to front and writes a gradient record per (splat, tile) pair.
pub fn blend_backward(b: &mut Builder, slots: Buf) {
    let (subgroup, tile_width, tile_height) = (b.shape.subgroup, b.shape.tile_width, b.shape.tile_height);
    let (segments, length) = (b.capacity.segments as u32, b.shape.segment_length);
    if segments > 1 {
        for segment in (0..segments).rev() {
            if b.labels {
                pass!(b, texel blend_backward_labels_segmented {
                    step: Buf::STEP, tile_starts: Buf::TILE_STARTS, slots: slots, splat_from_instance: Buf::SPLAT_FROM_INSTANCE,
                    splats: Buf::SPLATS, image: Buf::IMAGE, last: Buf::LAST, v_image: Buf::V_IMAGE,
                    v_instances_a: Buf::V_INSTANCES_A, v_instances_b: Buf::V_INSTANCES_B, v_instances_c: Buf::V_INSTANCES_C, counters: Buf::COUNTERS, layer_tiles: Buf::LAYER_TILES,
                    layer_state: Buf::LAYER_STATE, layer_weights: Buf::LAYER_WEIGHTS,
                    segment_back: Buf::SEGMENT_BACK,
                } [subgroup_size: subgroup, tile_width: tile_width, tile_height: tile_height,
                    segment: segment, segments: segments, segment_length: length], GRID());
            } else {
                pass!(b, texel blend_backward_segmented {
                    step: Buf::STEP, tile_starts: Buf::TILE_STARTS, slots: slots, splat_from_instance: Buf::SPLAT_FROM_INSTANCE,
                    splats: Buf::SPLATS, image: Buf::IMAGE, last: Buf::LAST, v_image: Buf::V_IMAGE,
                    v_instances_a: Buf::V_INSTANCES_A, v_instances_b: Buf::V_INSTANCES_B, v_instances_c: Buf::V_INSTANCES_C,
                    segment_back: Buf::SEGMENT_BACK,
                } [subgroup_size: subgroup, tile_width: tile_width, tile_height: tile_height,
                    segment: segment, segments: segments, segment_length: length], GRID());
            }
        }
    } else if b.labels {
        pass!(b, texel blend_backward_labels {
            step: Buf::STEP, tile_starts: Buf::TILE_STARTS, slots: slots, splat_from_instance: Buf::SPLAT_FROM_INSTANCE,
            splats: Buf::SPLATS, image: Buf::IMAGE, last: Buf::LAST, v_image: Buf::V_IMAGE,
            v_instances_a: Buf::V_INSTANCES_A, v_instances_b: Buf::V_INSTANCES_B, v_instances_c: Buf::V_INSTANCES_C, counters: Buf::COUNTERS, layer_tiles: Buf::LAYER_TILES,
            layer_state: Buf::LAYER_STATE, layer_weights: Buf::LAYER_WEIGHTS,
        } [subgroup_size: subgroup, tile_width: tile_width, tile_height: tile_height], GRID());
    } else {
        pass!(b, texel blend_backward {
            step: Buf::STEP, tile_starts: Buf::TILE_STARTS, slots: slots, splat_from_instance: Buf::SPLAT_FROM_INSTANCE,
            splats: Buf::SPLATS, image: Buf::IMAGE, last: Buf::LAST, v_image: Buf::V_IMAGE,
            v_instances_a: Buf::V_INSTANCES_A, v_instances_b: Buf::V_INSTANCES_B, v_instances_c: Buf::V_INSTANCES_C,
        } [subgroup_size: subgroup, tile_width: tile_width, tile_height: tile_height], GRID());
    }
}
