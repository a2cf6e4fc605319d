//! Reprojection errors of points, and the scale of the scene.

use super::{CaptureProblem, Finding, ViewReport};
use crate::colmap::Observation;
use crate::lens::Optics;
use crate::listing::ListedPhoto;
use glam::DVec3;
use labelgs_scene::Dataset;
use labelgs_scene::median::median;

/// Smallest reprojection error of a suspicious photo, px. Reconstructions of sharp photos have 0.3 to 1 px.
const ERROR_MIN: f64 = 2.0;
/// The same, relative to the median over photos; both must be exceeded.
const ERROR_RATIO_MIN: f64 = 3.0;
/// If half of the photos exceed this reprojection error, all poses are doubtful, px.
const MEDIAN_ERROR_MAX: f64 = 1.5;
/// Smallest plausible extent of a scene, world units.
const EXTENT_MIN: f64 = 1e-3;
/// Largest plausible extent of a scene, world units.
const EXTENT_MAX: f64 = 1e5;
/// Largest extent used, in median distances of the cameras from their centre.
const EXTENT_MEDIANS_MAX: f64 = 4.0;
/// Points farther than this from the cameras are outliers, in scene extents.
const OUTLIER_EXTENTS: f64 = 1000.0;

/// The points of a photo relative to its pose.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PointFit {
    /// Number of points that the photo should show.
    listed: usize,
    /// Number of these that lie behind the camera.
    pub(super) behind: usize,
    /// Median reprojection error, px; `None` if the lens does not cover half of the points.
    pub(super) error: Option<f64>,
}

impl PointFit {
    /// Measures a photo with its points.
    pub(super) fn measure((listed, points): &(ListedPhoto, Vec<Observation>)) -> Self {
        let optics = Optics::new(listed.camera.clone(), listed.lens);
        let mut behind = 0;
        let distances: Vec<f64> = points
            .iter()
            .map(|(pixel, world)| {
                let at = listed.camera.to_camera(*world);
                let found = optics.pixel(at);
                behind += usize::from(found.is_none() && at.z <= 0.0);
                found.map_or(f64::MAX, |found| found.distance(*pixel))
            })
            .collect();
        let error = median(distances).filter(|&error| error < f64::MAX);
        Self { listed: points.len(), behind, error }
    }
}

/// Finds photos whose points are elsewhere.
pub(super) fn findings(views: &[ViewReport], places: &[PointFit]) -> Vec<Finding> {
    let away = |(view, places): (&ViewReport, &PointFit)| {
        let text = format!("{} of its {} points lie behind the camera", places.behind, places.listed);
        (2 * places.behind > places.listed).then(|| Finding::new(CaptureProblem::Behind, Some(&view.name), text))
    };
    let mut found: Vec<Finding> = views.iter().zip(places).filter_map(away).collect();
    if 2 * found.len() > views.len() {
        return found;
    }
    let Some(usual) = median(views.iter().filter_map(|view| view.reprojection)) else { return found };
    let odd = |view: &ViewReport| {
        let error = view.reprojection.filter(|&error| error > ERROR_MIN.max(ERROR_RATIO_MIN * usual))?;
        let text = format!("half of its points are off by {error:.1} px or more; {usual:.1} px is usual");
        Some(Finding::new(CaptureProblem::Reprojection, Some(&view.name), text))
    };
    found.extend(views.iter().filter_map(odd));
    if usual > MEDIAN_ERROR_MAX {
        let text = format!("the points of most photos are off by {usual:.1} px; good poses are below 1 px");
        found.push(Finding::new(CaptureProblem::Reprojection, None, text));
    }
    found
}

/// Finds implausible sizes and distances.
pub(super) fn scale(dataset: &Dataset) -> Vec<Finding> {
    let mut found = Vec::new();
    let extent = dataset.extent();
    let mut add = |text: String| found.push(Finding::new(CaptureProblem::Scale, None, text));
    if !(EXTENT_MIN..=EXTENT_MAX).contains(&extent) {
        add(format!("the cameras spread over {extent:.1e} world units"));
    }
    // Medians, so that a single faraway camera moves neither the centre nor the outlier distance.
    let centres: Vec<DVec3> = dataset.train.iter().map(|view| view.camera.centre()).collect();
    let middle = |axis: usize| median(centres.iter().map(|centre| centre[axis])).unwrap_or(0.0);
    let centre = DVec3::new(middle(0), middle(1), middle(2));
    let radius = median(centres.iter().map(|at| at.distance(centre))).filter(|&radius| radius > 0.0);
    let far = OUTLIER_EXTENTS * radius.map_or(extent, |radius| extent.min(EXTENT_MEDIANS_MAX * radius));
    let outliers = dataset.points.iter().filter(|point| point.position.distance(centre) > far).count();
    if outliers > 0 {
        add(format!(
            "{outliers} points are more than {OUTLIER_EXTENTS} times as far away as the cameras are from each other"
        ));
    }
    found
}
