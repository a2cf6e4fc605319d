//! Reprojection errors of points, and the scale of the scene.

use super::{Fault, Finding, ViewReport};
use crate::colmap::Seen;
use crate::lens::Optics;
use crate::listing::Listed;
use glam::DVec3;
use labelgs_scene::Dataset;
use labelgs_scene::median::median;

/// Reprojection error from which a photo is odd: in px, and relative to the median over photos. Reconstructions of sharp
/// photos have 0.3 to 1 px.
const ERROR: (f64, f64) = (2.0, 3.0);
/// Reprojection error of half of the photos from which all poses are doubtful, px.
const ERROR_OF_ALL: f64 = 1.5;
/// Extents outside of which numbers of a scene look wrong, world units.
const EXTENTS: (f64, f64) = (1e-3, 1e5);
/// Most of an extent, in median distances of the cameras from their middle.
const EXTENT_MEDIANS_MAX: f64 = 4.0;
/// Points farther than this from the cameras are stray, scene extents.
const STRAY_EXTENTS: f64 = 1000.0;

/// Where the points of a photo are, by its pose.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Places {
    /// Points that the photo is said to show.
    listed: usize,
    /// Those that lie behind the camera.
    pub(super) behind: usize,
    /// Median distance from where the photo shows them, px; none if half of them are where the lens shows nothing.
    pub(super) error: Option<f64>,
}

impl Places {
    /// Measures a photo with its points.
    pub(super) fn of((listed, points): &(Listed, Vec<Seen>)) -> Self {
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
pub(super) fn findings(views: &[ViewReport], places: &[Places]) -> Vec<Finding> {
    let away = |(view, places): (&ViewReport, &Places)| {
        let text = format!("{} of its {} points lie behind the camera", places.behind, places.listed);
        (2 * places.behind > places.listed).then(|| Finding::new(Fault::Behind, Some(&view.name), text))
    };
    let mut found: Vec<Finding> = views.iter().zip(places).filter_map(away).collect();
    if 2 * found.len() > views.len() {
        return found;
    }
    let Some(usual) = median(views.iter().filter_map(|view| view.reprojection)) else { return found };
    let odd = |view: &ViewReport| {
        let error = view.reprojection.filter(|&error| error > ERROR.0.max(ERROR.1 * usual))?;
        let text = format!("half of its points are {error:.1} px or more from their places, {usual:.1} px is usual");
        Some(Finding::new(Fault::Reprojection, Some(&view.name), text))
    };
    found.extend(views.iter().filter_map(odd));
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
    // Medians: one camera far away moves neither the middle nor the distance of a stray point.
    let centres: Vec<DVec3> = dataset.train.iter().map(|view| view.camera.centre()).collect();
    let middle = |axis: usize| median(centres.iter().map(|centre| centre[axis])).unwrap_or(0.0);
    let centre = DVec3::new(middle(0), middle(1), middle(2));
    let radius = median(centres.iter().map(|at| at.distance(centre))).filter(|&radius| radius > 0.0);
    let far = STRAY_EXTENTS * radius.map_or(extent, |radius| extent.min(EXTENT_MEDIANS_MAX * radius));
    let stray = dataset.points.iter().filter(|point| point.position.distance(centre) > far).count();
    if stray > 0 {
        add(format!(
            "{stray} points are more than {STRAY_EXTENTS} times as far away as the cameras are from each other"
        ));
    }
    found
}
