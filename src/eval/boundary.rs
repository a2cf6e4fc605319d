//! Boundary IoU (Cheng et al. 2021): the overlap of the rims of two masks, so a large interior cannot hide a bad
//! outline.

use super::metrics::Overlap;

/// Width of the rim as a share of the image diagonal.
pub(crate) const RIM_DIAGONAL_SHARE: f64 = 0.02;

/// Returns the width of the rim, px: `RIM_DIAGONAL_SHARE` times the diagonal, rounded, at least 1.
pub fn rim_width(width: usize, height: usize) -> usize {
    ((RIM_DIAGONAL_SHARE * (width as f64).hypot(height as f64)).round() as usize).max(1)
}

/// Returns the pixels of a mask (row-major) within `reach` px of a pixel outside of it, diagonals included. Pixels
/// beyond the image are outside. The result equals the mask without its erosion by `reach` passes of a 3x3 square.
pub fn rim(mask: &[bool], width: usize, height: usize, reach: usize) -> Vec<bool> {
    let rows = eroded(mask, width, height, reach, |line, at| line * width + at);
    let both = eroded(&rows, height, width, reach, |line, at| at * width + line);
    mask.iter().zip(&both).map(|(&inside, &deep)| inside && !deep).collect()
}

/// Erodes along lines of `length` pixels; `place` maps line and position to an index.
fn eroded(
    mask: &[bool],
    length: usize,
    lines: usize,
    reach: usize,
    place: impl Fn(usize, usize) -> usize,
) -> Vec<bool> {
    let mut kept = vec![false; mask.len()];
    for line in 0..lines {
        let mut run = 0;
        for at in 0..length {
            run = if mask[place(line, at)] { run + 1 } else { 0 };
            if run > 2 * reach {
                kept[place(line, at - reach)] = true;
            }
        }
    }
    kept
}

/// Returns the IoU of the rims of two masks over the pixels with `counts`; `None` if neither has a rim there.
pub fn boundary_iou(
    found: &[bool],
    truth: &[bool],
    (width, height): (usize, usize),
    counts: impl Fn(usize) -> bool,
) -> Option<f64> {
    let reach = rim_width(width, height);
    let (found, truth) = (rim(found, width, height, reach), rim(truth, width, height, reach));
    Overlap::over(&found, &truth, counts).iou()
}
