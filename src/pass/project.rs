//! From Gaussians to splats in depth order, and gradients back.

use super::build::{Builder, Count, ONE, over_gaussians, over_splats};
use super::scan::{self, Total};
use super::sort::{self, SortBuffers};
use crate::pass;
use crate::scheduler::plan::{Buf, Stage};

/// Sorted Gaussian indices of the visible splats; the depth sort has an even number of passes.
pub const GAUSSIAN_FROM_SPLAT: Buf = Buf::DEPTH_VALUES_A;

/// Lists the visible Gaussians in depth order and projects them.
pub fn visible_splats(b: &mut Builder) {
    b.list.stage = Stage::Project;
    cull(b, false);
    order_and_project(b);
}

/// As [`visible_splats`], for the object of layer 1 alone.
#[cfg(feature = "lab")]
pub fn visible_splats_of_object(b: &mut Builder) {
    b.list.stage = Stage::Project;
    cull(b, true);
    order_and_project(b);
}

fn cull(b: &mut Builder, object: bool) {
    pass!(b, cull(object: object) {
        step: Buf::STEP, means: Buf::MEANS, scales: Buf::SCALES, depth_keys: Buf::DEPTH_KEYS,
        splat_from_gaussian: Buf::SPLAT_FROM_GAUSSIAN, counters: Buf::COUNTERS, labels: Buf::LABELS,
        label_from_layer: Buf::LABEL_FROM_LAYER,
    } [], over_gaussians());
}

fn order_and_project(b: &mut Builder) {
    scan::scan_visible(b, Buf::DEPTH_KEYS, Buf::VISIBLE_OFFSETS);
    pass!(b, prepare_splats { counters: Buf::COUNTERS, dispatch_args: Buf::DISPATCH_ARGS } [], ONE);
    pass!(b, compact {
        step: Buf::STEP, depth_keys: Buf::DEPTH_KEYS, visible_offsets: Buf::VISIBLE_OFFSETS,
        keys_out: Buf::DEPTH_KEYS_A, values_out: Buf::DEPTH_VALUES_A, failure: Buf::FAILURE,
    } [], over_gaussians());
    let buffers = SortBuffers {
        keys: [Buf::DEPTH_KEYS_A, Buf::DEPTH_KEYS_B],
        values: [Buf::DEPTH_VALUES_A, Buf::DEPTH_VALUES_B],
    };
    let (_, sorted) = sort::sort(b, buffers, 32, Count::Splats, "by depth", false);
    debug_assert_eq!(sorted, GAUSSIAN_FROM_SPLAT);
    project_forward(b);
    scan::scan(b, Buf::TILES_TOUCHED, Buf::INSTANCE_OFFSETS, Count::Splats, Total::Instances);
}

fn project_forward(b: &mut Builder) {
    let sh_degree = b.sh_degree;
    pass!(b, project_forward(labels: b.labels) {
        step: Buf::STEP, counters: Buf::COUNTERS, gaussian_from_splat: GAUSSIAN_FROM_SPLAT, means: Buf::MEANS,
        scales: Buf::SCALES, quats: Buf::QUATS, sh0: Buf::SH0, sh1: Buf::SH1, sh2: Buf::SH2, sh3: Buf::SH3,
        splats: Buf::SPLATS, tiles_touched: Buf::TILES_TOUCHED, splat_from_gaussian: Buf::SPLAT_FROM_GAUSSIAN,
        labels: Buf::LABELS, layer_from_label: Buf::LAYER_FROM_LABEL,
    } [sh_degree: sh_degree], over_splats());
}

/// Gradients of the splats back to the parameters of their Gaussians.
pub fn project_backward(b: &mut Builder) {
    backward(b, false, Buf::SPLAT_FROM_GAUSSIAN);
}

/// As [`project_backward`] for the splats of an object; added to the gradients of `scene_splats`.
#[cfg(feature = "lab")]
pub fn project_backward_of_object(b: &mut Builder, scene_splats: Buf) {
    backward(b, true, scene_splats);
}

fn backward(b: &mut Builder, object: bool, scene_splats: Buf) {
    let sh_degree = b.sh_degree;
    b.list.stage = Stage::ProjectBackward;
    pass!(b, project_backward(object: object) {
        step: Buf::STEP, failure: Buf::FAILURE, gaussian_from_splat: GAUSSIAN_FROM_SPLAT, means: Buf::MEANS,
        scales: Buf::SCALES, quats: Buf::QUATS, sh0: Buf::SH0, sh1: Buf::SH1, sh2: Buf::SH2, sh3: Buf::SH3,
        v_splats: Buf::V_SPLATS, v_means: Buf::V_MEANS, v_scales: Buf::V_SCALES, v_quats: Buf::V_QUATS,
        v_sh0: Buf::V_SH0, v_sh1: Buf::V_SH1, v_sh2: Buf::V_SH2, v_sh3: Buf::V_SH3, counters: Buf::COUNTERS,
        splat_from_gaussian: scene_splats,
    } [sh_degree: sh_degree], over_splats());
}
