//! The paper's label lifting on a trained model, for comparison with votes.

use crate::render::Render;
use crate::scene::{Camera, LabelMap, UNLABELLED};
use glam::DVec3;

/// Smallest blending weight at which a pixel's main Gaussian takes the pixel's label (LabelGS, equation 6).
const WEIGHT_MIN: f32 = 0.6;

/// Writes the labels of one view's mask to the main Gaussians of its pixels, over previous labels. Within the view the
/// larger weight wins, then the larger label. The centre of the Gaussian must project into the same mask (equation 7).
/// `camera` is [relative](Camera::relative_to) to the origin of `means`.
pub(crate) fn lift(labels: &mut [u32], means: &[[f32; 3]], camera: &Camera, rendered: &Render, mask: &LabelMap) {
    let mut best = vec![(0.0_f32, UNLABELLED); labels.len()];
    for ((&top, &weight), &id) in rendered.top_id.iter().zip(&rendered.top_weight).zip(&mask.ids) {
        let Ok(row) = usize::try_from(top) else { continue };
        let vote = (weight, u32::from(id));
        if id == 0 || weight < WEIGHT_MIN || vote <= best[row] {
            continue;
        }
        let at = camera.project(camera.to_camera(DVec3::from_array(means[row].map(f64::from)))).floor();
        let inside = at.x >= 0.0 && at.y >= 0.0 && at.x < f64::from(camera.width) && at.y < f64::from(camera.height);
        if inside && mask.at(at.x as u32, at.y as u32) == id {
            best[row] = vote;
        }
    }
    for (label, (weight, voted)) in labels.iter_mut().zip(best) {
        if weight > 0.0 {
            *label = voted;
        }
    }
}
