//! Removes photos with outlier poses: structure from motion sometimes throws a camera far out of the scene.

use super::bad_photos::allowed;
use super::listing::ListedPhoto;
use labelgs_files::names::shortened;
use labelgs_scene::Point;
use labelgs_scene::spread::Spread;

/// Distance beyond which a camera is an outlier, in radii of the cameras or the points, whichever spread wider.
const OUTLIER_RADII: f64 = 30.0;
/// The same without points, in radii of the cameras: most may be close together, and two of them elsewhere.
const RADII_WITHOUT_POINTS: f64 = 1000.0;
/// Fewest points that determine the size of the scene.
const POINTS_MIN: usize = 20;
/// Most points that are examined.
const POINTS_MAX: usize = 10_000;

/// Removes photos with outlier poses if they are few. Notes them in `faults`.
pub(super) fn remove(views: &mut Vec<ListedPhoto>, points: &[Point], max_share: f32, faults: &mut Vec<String>) {
    let Some(cameras) = Spread::measure(views.iter().map(|view| view.camera.centre())) else { return };
    let some = points.iter().step_by(points.len().div_ceil(POINTS_MAX).max(1)).map(|point| point.position);
    let seen = Spread::measure(some).filter(|_| points.len() >= POINTS_MIN);
    let limit = match seen {
        // Points may be anywhere around the cameras.
        Some(seen) => OUTLIER_RADII * cameras.radius.max(seen.radius + seen.middle.distance(cameras.middle)),
        None => RADII_WITHOUT_POINTS * cameras.radius,
    };
    let is_stray = |view: &ListedPhoto| view.camera.centre().distance(cameras.middle) > limit;
    let stray: Vec<&str> = views.iter().filter(|view| is_stray(view)).map(|view| view.name.as_str()).collect();
    if stray.is_empty() || stray.len() > allowed(max_share, views.len()).max(1) {
        return;
    }
    tracing::debug!("photos with stray poses: {}", stray.join(", "));
    faults.push(format!(
        "{} of {} photos omitted, because their poses are more than {limit:.3} units away from the others, most of \
         which lie within {:.3}: {}",
        stray.len(),
        views.len(),
        cameras.radius,
        shortened(&stray)
    ));
    views.retain(|view| !is_stray(view));
}
