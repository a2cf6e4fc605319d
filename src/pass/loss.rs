//! L1 and D-SSIM against the photo: value and gradient. The filter is separable and needs no barriers.

use super::Supervision;
use super::build::{Builder, ONE};
use crate::pass::build::pass;
use crate::scheduler::plan::{Buf, Grid, Stage};
use crate::shaders::constants;

/// Rows or columns that one lane filters in registers (glsl/include/window.glsl).
const STRIP: u32 = 8;

/// Writes `v_image` and the loss sums, for an image of at most `width` x `height` px.
pub(crate) fn photo_loss(b: &mut Builder, width: u32, height: u32) {
    b.list.stage = Stage::LOSS;
    let columns = |channels| Grid::Groups(width.div_ceil(64), height.div_ceil(STRIP), channels);
    let rows = Grid::Groups(height.div_ceil(64), width.div_ceil(STRIP), 3);
    pass!(b, ssim_columns { step: Buf::STEP, image: Buf::IMAGE, target: Buf::TARGET, moments: Buf::SSIM_A } [],
        columns(3));
    pass!(b, ssim_rows { step: Buf::STEP, moments: Buf::SSIM_A, target: Buf::TARGET, v_moments: Buf::SSIM_B } [],
        rows);
    pass!(b, ssim_rows_backward { step: Buf::STEP, v_moments: Buf::SSIM_B, v_rows: Buf::SSIM_A } [], rows);
    pass!(b, loss_columns_backward {
        step: Buf::STEP, v_rows: Buf::SSIM_A, image: Buf::IMAGE, target: Buf::TARGET, v_image: Buf::V_IMAGE,
        loss_partials: Buf::LOSS_PARTIALS,
    } [], columns(1));
    if b.supervision != Supervision::Disagreement {
        reduce(b, partials(b.shape.subgroup, width, height));
    }
}

/// Sums the loss after the backward walk, which finds the disagreement of the labels.
pub(super) fn reduce_last(b: &mut Builder, width: u32, height: u32) {
    b.list.stage = Stage::LOSS;
    reduce(b, partials(b.shape.subgroup, width, height));
}

/// Multiplies the picture by the exposure of its photo, row `row` of the step.
pub(crate) fn expose(b: &mut Builder, row: u32) {
    b.list.stage = Stage::LOSS;
    pass!(b, expose {
        step: Buf::STEP, step_rows: Buf::STEP_ROWS, shared_parameters: Buf::SHARED, image: Buf::IMAGE,
    } [row: row], over_pixels(b, 64));
}

/// Turns the gradient of the exposed picture into that of the blended one, and writes the gradient of the exposure, row
/// `row` of the `stride` rows of a photo.
pub(crate) fn expose_backward(b: &mut Builder, row: u32, stride: u32) {
    b.list.stage = Stage::LOSS;
    // The maps of SSIM are not needed any more.
    let partials = Buf::SSIM_B;
    pass!(b, expose_backward {
        step: Buf::STEP, step_rows: Buf::STEP_ROWS, shared_parameters: Buf::SHARED, image: Buf::IMAGE,
        v_image: Buf::V_IMAGE, exposure_partials: partials, target: Buf::TARGET,
    } [row: row], over_pixels(b, u64::from(constants::EXPOSED)));
    let rows = b.capacity.shared_rows as u32;
    pass!(b, expose_reduce {
        step: Buf::STEP, step_rows: Buf::STEP_ROWS, shared_parameters: Buf::SHARED, exposure_partials: partials,
        v_shared: Buf::V_SHARED,
    } [stride: stride, rows: rows, row: row], ONE);
}

/// Grid over the pixels of an image, `each` per workgroup.
fn over_pixels(b: &Builder, each: u64) -> Grid {
    let groups = b.capacity.pixels.div_ceil(each).max(1) as u32;
    Grid::Groups(groups.min(constants::FOLD), groups.div_ceil(constants::FOLD), 1)
}

fn reduce(b: &mut Builder, partials: u32) {
    pass!(b, loss_reduce(labels: b.supervision.has_layers(), disagreement: b.supervision == Supervision::Disagreement) {
        loss_partials: Buf::LOSS_PARTIALS, counters: Buf::COUNTERS, layer_loss: Buf::LAYER_LOSS, step: Buf::STEP,
        disagreement: Buf::DISAGREEMENT,
    } [partials: partials], ONE);
}

/// Number of partial loss sums of an image: one for each subgroup of each strip.
pub(crate) fn partials(subgroup: u32, width: u32, height: u32) -> u32 {
    width.div_ceil(64) * (64 / subgroup) * height.div_ceil(STRIP)
}
