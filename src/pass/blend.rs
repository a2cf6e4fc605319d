//! Blending of the tiles, forward and backward.

use super::build::{Builder, args};
use super::project::GAUSSIAN_FROM_SPLAT;
use crate::pass;
use crate::plan::Buf;
use crate::shaders::constants;

/// Blends all tiles front to back; with labels also the object layers, their loss, and the lift.
pub fn blend_forward(b: &mut Builder) {
    let (subgroup, tile_width, tile_height) = (b.shape.subgroup, b.shape.tile_width, b.shape.tile_height);
    let grid = args(constants::ARGS_BLEND);
    if b.labels {
        pass!(b, texel blend_forward_labels {
            step: Buf::STEP, counters: Buf::COUNTERS, tile_starts: Buf::TILE_STARTS, tile_ends: Buf::TILE_ENDS,
            sorted_splats: Buf::SORTED_SPLATS, splats: Buf::SPLATS, image: Buf::IMAGE, last: Buf::LAST,
            layer_tiles: Buf::LAYER_TILES, target: Buf::TARGET, view_labels: Buf::VIEW_LABELS,
            layer_occluders: Buf::LAYER_OCCLUDERS, label_from_layer: Buf::LABEL_FROM_LAYER,
            gaussian_from_splat: GAUSSIAN_FROM_SPLAT, layer_state: Buf::LAYER_STATE, layer_loss: Buf::LAYER_LOSS,
            label_keys: Buf::LABEL_KEYS, layer_from_label: Buf::LAYER_FROM_LABEL,
        } [subgroup_size: subgroup, tile_width: tile_width, tile_height: tile_height], grid);
    } else {
        pass!(b, texel blend_forward {
            step: Buf::STEP, counters: Buf::COUNTERS, tile_starts: Buf::TILE_STARTS, tile_ends: Buf::TILE_ENDS,
            sorted_splats: Buf::SORTED_SPLATS, splats: Buf::SPLATS, image: Buf::IMAGE, last: Buf::LAST,
        } [subgroup_size: subgroup, tile_width: tile_width, tile_height: tile_height], grid);
    }
}

/// Blends all tiles and keeps the main Gaussian of each pixel, its weight, and depth.
pub fn blend_forward_main(b: &mut Builder) {
    let (subgroup, tile_width, tile_height) = (b.shape.subgroup, b.shape.tile_width, b.shape.tile_height);
    pass!(b, texel blend_forward_main {
        step: Buf::STEP, counters: Buf::COUNTERS, tile_starts: Buf::TILE_STARTS, tile_ends: Buf::TILE_ENDS,
        sorted_splats: Buf::SORTED_SPLATS, splats: Buf::SPLATS, image: Buf::IMAGE, last: Buf::LAST,
        main_gaussian: Buf::MAIN_GAUSSIAN, main_weight_depth: Buf::MAIN_WEIGHT_DEPTH,
        gaussian_from_splat: GAUSSIAN_FROM_SPLAT,
    } [subgroup_size: subgroup, tile_width: tile_width, tile_height: tile_height], args(constants::ARGS_BLEND));
}

/// Walks all tiles back to front and writes a gradient record per (splat, tile) pair.
pub fn blend_backward(b: &mut Builder, slots: Buf) {
    let (subgroup, tile_width, tile_height) = (b.shape.subgroup, b.shape.tile_width, b.shape.tile_height);
    let grid = args(constants::ARGS_BLEND);
    if b.labels {
        pass!(b, texel blend_backward_labels {
            step: Buf::STEP, tile_starts: Buf::TILE_STARTS, sorted_splats: Buf::SORTED_SPLATS, slots: slots,
            splats: Buf::SPLATS, image: Buf::IMAGE, last: Buf::LAST, v_image: Buf::V_IMAGE,
            v_instances: Buf::V_INSTANCES, counters: Buf::COUNTERS, layer_tiles: Buf::LAYER_TILES,
            layer_state: Buf::LAYER_STATE,
        } [subgroup_size: subgroup, tile_width: tile_width, tile_height: tile_height], grid);
    } else {
        pass!(b, texel blend_backward {
            step: Buf::STEP, tile_starts: Buf::TILE_STARTS, sorted_splats: Buf::SORTED_SPLATS, slots: slots,
            splats: Buf::SPLATS, image: Buf::IMAGE, last: Buf::LAST, v_image: Buf::V_IMAGE,
            v_instances: Buf::V_INSTANCES,
        } [subgroup_size: subgroup, tile_width: tile_width, tile_height: tile_height], grid);
    }
}
