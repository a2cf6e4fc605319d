//! Reprojection errors of points, and the scale of the scene.

use super::{Fault, Finding, ViewReport};
use crate::io::colmap::Seen;
use crate::io::lens::Optics;
use crate::io::listing::Listed;
use crate::scene::Dataset;
use crate::scene::median::median;

/// Reprojection error from which a photo is odd: in px, and relative to the median over photos. Reconstructions of sharp
/// photos have 0.3 to 1 px.
const ERROR: (f64, f64) = (2.0, 3.0);
/// Reprojection error of half of the photos from which all poses are doubtful, px.
const ERROR_OF_ALL: f64 = 1.5;
/// Extents outside of which numbers of a scene look wrong, world units.
const EXTENTS: (f64, f64) = (1e-3, 1e5);
/// Points farther than this from the cameras are stray, scene extents.
const STRAY: f64 = 1000.0;

/// Returns the median distance of the points of a photo from where it shows them, px.
pub(super) fn error((listed, points): &(Listed, Vec<Seen>)) -> Option<f64> {
    let optics = Optics::new(listed.camera.clone(), listed.lens);
    let distance = |(pixel, world): &Seen| {
        let found = optics.pixel(listed.camera.to_camera(*world));
        found.map_or(f64::MAX, |found| found.distance(*pixel))
    };
    median(points.iter().map(distance))
}

/// Finds photos whose points are elsewhere.
pub(super) fn findings(views: &[ViewReport]) -> Vec<Finding> {
    let Some(usual) = median(views.iter().filter_map(|view| view.reprojection)) else { return Vec::new() };
    let odd = |view: &ViewReport| {
        let error = view.reprojection.filter(|&error| error > ERROR.0.max(ERROR.1 * usual))?;
        let text = format!("half of its points are {error:.1} px or more from their places, {usual:.1} px is usual");
        Some(Finding::new(Fault::Reprojection, Some(&view.name), text))
    };
    let mut found: Vec<Finding> = views.iter().filter_map(odd).collect();
    if usual > ERROR_OF_ALL {
        let text = format!("the points of most photos are {usual:.1} px from their places; good poses have below 1 px");
        found.push(Finding::new(Fault::Reprojection, None, text));
    }
    found
}

/// Finds sizes and distances that look wrong.
pub(super) fn scale(dataset: &Dataset) -> Vec<Finding> {
    let mut found = Vec::new();
    let extent = dataset.extent();
    let mut add = |text: String| found.push(Finding::new(Fault::Scale, None, text));
    if !(EXTENTS.0..=EXTENTS.1).contains(&extent) {
        add(format!("the cameras spread over {extent:.1e} world units"));
    }
    let centre =
        dataset.train.iter().map(|view| view.camera.centre()).sum::<glam::DVec3>() / dataset.train.len().max(1) as f64;
    let stray = dataset.points.iter().filter(|point| point.position.distance(centre) > STRAY * extent).count();
    if stray > 0 {
        add(format!("{stray} points are more than {STRAY} times as far away as the cameras are from each other"));
    }
    found
}
