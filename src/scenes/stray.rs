//! Photos whose poses are far from everything else: structure from motion at times throws a camera out of the scene.

use super::bad_photos::allowed;
use super::listing::Listed;
use labelgs_files::names::shortened;
use labelgs_scene::Point;
use labelgs_scene::spread::Spread;

/// Distance from which a camera is stray, in radii of cameras and points, whichever are wider.
const STRAY_RADII: f64 = 30.0;
/// The same without points, in radii of the cameras: they may be together, and two of them at another place.
const RADII_WITHOUT_POINTS: f64 = 1000.0;
/// Fewest points that say how wide the scene is.
const POINTS_MIN: usize = 20;
/// Most points that are looked at.
const POINTS_MAX: usize = 10_000;

/// Removes stray photos, if they are few. Notes them in `faults`.
pub(super) fn remove(views: &mut Vec<Listed>, points: &[Point], max_share: f32, faults: &mut Vec<String>) {
    let Some(cameras) = Spread::measure(views.iter().map(|view| view.camera.centre())) else { return };
    let some = points.iter().step_by(points.len().div_ceil(POINTS_MAX).max(1)).map(|point| point.position);
    let seen = Spread::measure(some).filter(|_| points.len() >= POINTS_MIN);
    let limit = match seen {
        // Points may lie anywhere around the cameras.
        Some(seen) => STRAY_RADII * cameras.radius.max(seen.radius + seen.middle.distance(cameras.middle)),
        None => RADII_WITHOUT_POINTS * cameras.radius,
    };
    let is_stray = |view: &Listed| view.camera.centre().distance(cameras.middle) > limit;
    let stray: Vec<&str> = views.iter().filter(|view| is_stray(view)).map(|view| view.name.as_str()).collect();
    if stray.is_empty() || stray.len() > allowed(max_share, views.len()).max(1) {
        return;
    }
    tracing::debug!("photos with stray poses: {}", stray.join(", "));
    faults.push(format!(
        "{} of {} photos left out, because their poses are more than {limit:.3} units away from the others, most of \
         which lie within {:.3}: {}",
        stray.len(),
        views.len(),
        cameras.radius,
        shortened(&stray)
    ));
    views.retain(|view| !is_stray(view));
}
