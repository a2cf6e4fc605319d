//! L1 and D-SSIM against the photo: value and gradient, also through the exposure of the photo.
//!
//! There are two forms, chosen by [`KernelShape::loss_tile`]: one dispatch per direction of each separable filter,
//! without barriers, or a single dispatch with tiles in shared memory.

use super::build::{Builder, ONE_GROUP};
use super::{KernelShape, Supervision};
use crate::pass::build::pass;
use crate::scheduler::plan::{Buf, Grid, Stage};
use crate::shaders::constants;

/// Rows or columns that one lane filters in registers, px (glsl/include/ssim.glsl).
const STRIP_PIXELS: u32 = 8;

/// Writes `v_image` and the loss sums, for an image of at most `width` x `height` px.
pub(crate) fn photo_loss(b: &mut Builder, width: u32, height: u32) {
    b.list.stage = Stage::LOSS;
    b.loss_partials = partials(b.shape, width, height);
    if b.shape.loss_tile > 0 {
        return tiled_loss(b, width, height);
    }
    let columns = |channels| Grid::Groups(width.div_ceil(64), height.div_ceil(STRIP_PIXELS), channels);
    let rows = Grid::Groups(height.div_ceil(64), width.div_ceil(STRIP_PIXELS), 3);
    pass!(b, ssim_columns { moments: Buf::SSIM_A } [],
        columns(3));
    pass!(b, ssim_rows { moments: Buf::SSIM_A, v_moments: Buf::SSIM_B } [],
        rows);
    pass!(b, ssim_rows_backward { v_moments: Buf::SSIM_B, v_rows: Buf::SSIM_A } [], rows);
    pass!(b, loss_columns_backward { v_rows: Buf::SSIM_A } [], columns(1));
    if b.supervision != Supervision::Disagreement {
        reduce(b);
    }
}

fn tiled_loss(b: &mut Builder, width: u32, height: u32) {
    let side = b.shape.loss_tile;
    let (labels, exposure) = (b.supervision.has_layers(), b.exposure.is_some());
    pass!(b, loss_tile(labels: labels, disagreement: !labels && sums_all(b), exposure: exposure)
        { shared_parameters: Buf::SHARED }
            [row: b.exposure.unwrap_or(0)], Grid::Groups(width.div_ceil(side), height.div_ceil(side), 1));
}

/// Applies the photo's exposure (row `row` of the step) to the picture, unless the loss pass does so.
pub(crate) fn expose(b: &mut Builder, row: u32) {
    b.list.stage = Stage::LOSS;
    b.exposure = Some(row);
    if b.shape.loss_tile > 0 {
        return;
    }
    pass!(b, expose { shared_parameters: Buf::SHARED } [row: row], over_pixels(b, 64));
}

/// Converts the gradient of the exposed picture to that of the blended picture, unless the loss pass does so. Writes
/// the gradient of the exposure, row `row` of a photo's `stride` rows.
pub(crate) fn expose_backward(b: &mut Builder, row: u32, stride: u32) {
    b.list.stage = Stage::LOSS;
    let mut count = b.loss_partials;
    if b.shape.loss_tile == 0 {
        count = b.capacity.pixels.div_ceil(u64::from(constants::EXPOSED)) as u32;
        pass!(b, expose_backward { shared_parameters: Buf::SHARED }
            [row: row, partials: count], over_pixels(b, u64::from(constants::EXPOSED)));
    }
    let rows = b.capacity.shared_rows as u32;
    pass!(b, expose_reduce { shared_parameters: Buf::SHARED }
        [stride: stride, rows: rows, row: row, partials: count], ONE_GROUP);
}

/// Grid over the pixels of an image, `each` per workgroup.
fn over_pixels(b: &Builder, each: u64) -> Grid {
    let groups = b.capacity.pixels.div_ceil(each).max(1) as u32;
    Grid::Groups(groups.min(constants::FOLD), groups.div_ceil(constants::FOLD), 1)
}

/// True if the photo loss also sums the label disagreement, which the forward blend of GPUs computes.
fn sums_all(b: &Builder) -> bool {
    b.supervision == Supervision::Disagreement && b.shape.loss_tile > 0 && b.shape.group_blend.is_some()
}

/// Sums the loss with the label disagreement after the backward blend, which computes it, unless the photo loss does.
pub(super) fn reduce_disagreement(b: &mut Builder) {
    if b.supervision == Supervision::Disagreement && !sums_all(b) {
        reduce(b);
    }
}

/// Sums the loss.
fn reduce(b: &mut Builder) {
    b.list.stage = Stage::LOSS;
    pass!(b, loss_reduce(labels: b.supervision.has_layers(), disagreement: b.supervision == Supervision::Disagreement) {} [partials: b.loss_partials], ONE_GROUP);
}

/// Returns the number of partial loss sums of an image: one per tile, or per subgroup of each strip.
pub(crate) fn partials(shape: &KernelShape, width: u32, height: u32) -> u32 {
    match shape.loss_tile {
        0 => width.div_ceil(64) * (64 / shape.subgroup) * height.div_ceil(STRIP_PIXELS),
        side => width.div_ceil(side) * height.div_ceil(side),
    }
}
