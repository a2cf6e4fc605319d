//! Small patches of a photo, to be found in other photos.

use super::Frame;
use glam::{DVec2, DVec3};

/// Pixels on each side of a patch's centre. Larger patches cross contours more often.
const PATCH_REACH_PX: u32 = 2;
/// Pixels per patch.
pub(super) const PATCH_PIXELS: usize = ((2 * PATCH_REACH_PX + 1) * (2 * PATCH_REACH_PX + 1)) as usize;
/// Index of the centre pixel.
pub(super) const PATCH_CENTRE: usize = PATCH_PIXELS / 2;
/// Smallest cell side, px. Each cell of a frame has at most one patch.
const CELL_MIN: u32 = 8;
/// Most cells per frame.
const CELLS_MAX: f64 = 2000.0;
/// Smallest mean square of the colour derivatives, 1 / px^2, summed over channels.
const CONTRAST_MIN: f32 = 0.03 * 0.03;
/// Largest relative depth range of a patch, so that it lies on one surface.
const DEPTH_RANGE_MAX: f32 = 0.04;

/// A patch of a frame, with its pixels in rows.
#[derive(Clone, Debug)]
pub(super) struct Patch {
    /// Pixel positions in camera space, world units.
    pub(super) places: [DVec3; PATCH_PIXELS],
    /// Pixel colours minus the mean of each channel.
    pub(super) colours: [[f64; 3]; PATCH_PIXELS],
}

/// Returns the patches of a frame: one per cell, where the colour gradient is largest.
pub(super) fn frame_patches(frame: &Frame) -> Vec<Patch> {
    let (width, height) = (frame.camera.width, frame.camera.height);
    let cell = CELL_MIN.max((f64::from(width) * f64::from(height) / CELLS_MAX).sqrt().ceil() as u32);
    // Squared gradient of each pixel, summed over channels.
    let square = |[_, by_x, by_y]: &[[f32; 3]; 3]| by_x.iter().chain(by_y).map(|value| value * value).sum::<f32>();
    let change: Vec<f32> = frame.colours.iter().map(square).collect();
    let margin = PATCH_REACH_PX + 1;
    let mut found = Vec::new();
    for top in (margin..height.saturating_sub(margin + cell - 1)).step_by(cell as usize) {
        for left in (margin..width.saturating_sub(margin + cell - 1)).step_by(cell as usize) {
            let pixels = (top..top + cell).flat_map(|y| (left..left + cell).map(move |x| (x, y)));
            let sum = |&(x, y): &(u32, u32)| around(x, y).map(|(x, y)| change[(y * width + x) as usize]).sum::<f32>();
            let largest = pixels.map(|at| (sum(&at), at)).max_by(|a, b| a.0.total_cmp(&b.0));
            let strong = largest.filter(|(sum, _)| *sum >= CONTRAST_MIN * PATCH_PIXELS as f32);
            found.extend(strong.and_then(|(_, (x, y))| patch(frame, x, y)));
        }
    }
    found
}

/// Returns the pixels of the patch around a pixel.
fn around(x: u32, y: u32) -> impl Iterator<Item = (u32, u32)> {
    (y - PATCH_REACH_PX..=y + PATCH_REACH_PX)
        .flat_map(move |row| (x - PATCH_REACH_PX..=x + PATCH_REACH_PX).map(move |column| (column, row)))
}

fn patch(frame: &Frame, x: u32, y: u32) -> Option<Patch> {
    let (mut places, mut colours) = ([DVec3::ZERO; PATCH_PIXELS], [[0.0; 3]; PATCH_PIXELS]);
    let (mut nearest, mut farthest) = (f32::INFINITY, 0.0_f32);
    for (k, (x, y)) in around(x, y).enumerate() {
        let index = (y * frame.camera.width + x) as usize;
        let depth = frame.depth[index];
        if depth.is_nan() {
            return None;
        }
        (nearest, farthest) = (nearest.min(depth), farthest.max(depth));
        places[k] = frame.camera.ray(DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5)) * f64::from(depth);
        colours[k] = frame.colours[index][0].map(f64::from);
    }
    without_mean(&mut colours);
    (farthest - nearest <= DEPTH_RANGE_MAX * nearest).then_some(Patch { places, colours })
}

/// Subtracts the mean of each channel.
pub(super) fn without_mean(colours: &mut [[f64; 3]; PATCH_PIXELS]) {
    for k in 0..3 {
        let mean = colours.iter().map(|colour| colour[k]).sum::<f64>() / PATCH_PIXELS as f64;
        colours.iter_mut().for_each(|colour| colour[k] -= mean);
    }
}
