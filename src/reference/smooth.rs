//! The smallest Gaussian size that photos can resolve.

use super::{Row, Rules};
use glam::DVec3;
use labelgs_scene::Camera;

/// Returns the row limited to its smallest size, given the limit from earlier views (0 if none); the limit after this
/// view, whose photo has `focal` px focal length at full size; and the margin of the nearest decision, relative to the
/// view.
pub fn smooth(rules: &Rules, camera: &Camera, focal: f64, row: &Row, before: f64) -> (Row, f64, f64) {
    let at = camera.to_camera(DVec3::from(row.mean));
    let pixel = camera.project(at);
    let beyond = |place: f64, size: u32| {
        let share = place / f64::from(size);
        (share + rules.smooth_margin).min(1.0 + rules.smooth_margin - share)
    };
    let margins = [at.z / rules.near - 1.0, beyond(pixel.x, camera.width), beyond(pixel.y, camera.height)];
    let inside = if at.z > 0.0 { margins.into_iter().fold(f64::INFINITY, f64::min) } else { margins[0] };
    let limit = rules.finest * at.z / focal;
    let after = match inside > 0.0 {
        false => before,
        true if before > 0.0 => before.min(limit),
        true => limit,
    };
    let scale = if after > 0.0 { row.scale.map(|scale| scale.max(after.ln())) } else { row.scale };
    (Row { scale, ..*row }, after, inside.abs())
}
