//! Scans a capture for problems that harm training: wrong poses, blurred photos, varying exposure or tint, isolated
//! photos, an unusual scale. Each finding names its cure.

mod finding;
mod gains;
mod neighbours;
mod photos;
mod poses;
mod shown_points;
mod surroundings;

use super::colmap::{self, Observation};
use super::listed_path::SceneFolder;
use super::listing::ListedPhoto;
use super::lookup::Lookup;
use super::photo_recipe::at_photo_size;
use super::pose_convention::Native;
use super::window::{Window, windows};
use glam::{DVec2, DVec3};
use labelgs_scene::median::median;
use labelgs_scene::stage::Stage;
use labelgs_scene::{Dataset, Result, View};
use poses::PointFit;
use serde::Serialize;
use shown_points::{Mark, ShownPoints};
use std::cell::OnceCell;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

pub use finding::{CaptureProblem, Finding};
pub use surroundings::{still_share, text as surroundings_text};

/// The measurements of a photo.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ViewReport {
    /// Name of the photo.
    pub name: String,
    /// Number of points in the photo.
    pub points: usize,
    /// Number of its points that at least two other photos also show.
    pub shared: usize,
    /// Number of points that the reconstruction assigns to the photo although they lie behind its camera.
    pub behind: usize,
    /// Median reprojection error of its points, px. `None` without observations, or if half of the points lie behind
    /// the camera.
    pub reprojection: Option<f64>,
    /// Sharpness relative to neighbouring photos; `None` without a photo.
    pub sharpness: Option<f64>,
    /// Brightness relative to the mean of all photos, from shared points; `None` with too few of them.
    pub gain: Option<f64>,
    /// The same per channel: red, green and blue.
    pub channel_gains: Option<[f64; 3]>,
}

/// The result of a scan.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// Radius of the cameras around their mean, times 1.1, world units.
    pub extent: f64,
    /// Number of photos. Photos with wide lenses have several views.
    pub photos: usize,
    /// Points of the reconstruction.
    pub points: usize,
    /// Median of the photos' reprojection errors, px.
    pub reprojection: Option<f64>,
    /// Largest gain of a photo divided by the smallest.
    pub gain_spread: Option<f64>,
    /// All views, by name.
    pub views: Vec<ViewReport>,
    /// Problems, by kind and photo.
    pub findings: Vec<Finding>,
}

/// The points that the reconstruction assigns to each photo.
struct Observations {
    photos: BTreeMap<String, (ListedPhoto, Vec<Observation>)>,
    /// The photo of each cube face of a photo with a wide lens.
    faces: BTreeMap<String, String>,
}

impl Observations {
    fn read(dataset: &Dataset, lookup: &Lookup) -> Result<Self> {
        let _stage = Stage::new("reading which photo shows which point", 0);
        // Paths were checked when the scene was opened.
        let lookup = Lookup { allow_outside: true, ..lookup.clone() };
        let mut photos = colmap::observations(&SceneFolder::new(&dataset.root, &lookup), &dataset.source)?;
        photos.values_mut().for_each(|(listed, _)| lookup.poses.apply(Native::COLMAP, &mut listed.camera));
        let mut faces = BTreeMap::new();
        for (listed, _) in photos.values().filter(|(listed, _)| !listed.lens.is_pinhole()) {
            // Unreadable photos were omitted then, too.
            let Ok(camera) = at_photo_size(listed) else { continue };
            let views = Window::all(&listed.name, &camera, &listed.lens);
            faces.extend(views.into_iter().map(|view| (view.name, view.photo)));
        }
        Ok(Self { photos, faces })
    }

    fn for_view(&self, view: &View) -> Option<&(ListedPhoto, Vec<Observation>)> {
        self.photos.get(self.faces.get(&view.name).unwrap_or(&view.name))
    }
}

/// The points that each training photo shows. They are read once, on demand.
pub struct Sightings<'a> {
    lookup: &'a Lookup,
    dataset: &'a Dataset,
    shown: OnceCell<ShownPoints<'a>>,
}

impl<'a> Sightings<'a> {
    /// Creates the sightings of an open scene without reading them.
    pub fn new(lookup: &'a Lookup, dataset: &'a Dataset) -> Self {
        Self { lookup, dataset, shown: OnceCell::new() }
    }

    fn shown(&self) -> Result<&ShownPoints<'a>> {
        if let Some(shown) = self.shown.get() {
            return Ok(shown);
        }
        let looked = Observations::read(self.dataset, self.lookup)?;
        let shown = ShownPoints::new(self.dataset.train.iter().collect(), &self.dataset.points, &looked);
        Ok(self.shown.get_or_init(|| shown))
    }

    /// Returns the brightness of each training photo relative to the mean of all, from shared points: factors of red,
    /// green and blue, or `None` with too few such points.
    pub fn gains(&self) -> Result<Vec<Option<[f64; 3]>>> {
        if self.dataset.points.is_empty() {
            return Ok(vec![None; self.dataset.train.len()]);
        }
        let views: Vec<&View> = self.dataset.train.iter().collect();
        let gains = gains::gains(&views, self.shown()?)?;
        Ok(gains.into_iter().map(|of| of.map(|of| of.channels)).collect())
    }

    /// Returns the pixel and position of the points that each training photo shows. Lists are empty if the
    /// reconstruction does not assign points to photos.
    pub fn points(&self) -> Result<Vec<Vec<(DVec2, DVec3)>>> {
        let place = |&(index, at): &Mark| (at, self.dataset.points[index].position);
        let of_view = |marks: &Option<Vec<Mark>>| marks.iter().flatten().map(place).collect();
        Ok(self.shown()?.listed().iter().map(of_view).collect())
    }
}

/// Scans a scene that was read with photos.
pub fn scan(scene: &Path, lookup: &Lookup, dataset: &Dataset) -> Result<Report> {
    let looked = Observations::read(dataset, lookup)?;
    let views: Vec<&View> = dataset.all();
    let shown = ShownPoints::new(views.clone(), &dataset.points, &looked);
    let counts = shown.counts();
    let places: Vec<PointFit> =
        views.iter().map(|view| looked.for_view(view).map_or_else(PointFit::default, PointFit::measure)).collect();
    let sharpness = photos::sharpness(&views)?;
    let gains = gains::gains(&views, &shown)?;
    let reports: Vec<ViewReport> = (0..views.len())
        .map(|index| ViewReport {
            name: views[index].name.clone(),
            points: counts[index].0,
            shared: counts[index].1,
            behind: places[index].behind,
            reprojection: places[index].error,
            sharpness: sharpness[index],
            gain: gains[index].map(|of| of.grey),
            channel_gains: gains[index].map(|of| of.channels),
        })
        .collect();
    let mut findings = poses::findings(&reports, &places);
    findings.extend(photos::findings(&reports));
    // A photo that looks away from its points shares none of them. Report only the pose, not the isolation.
    let away: BTreeSet<String> =
        findings.iter().filter(|of| of.fault == CaptureProblem::Behind).filter_map(|of| of.view.clone()).collect();
    if 2 * away.len() <= views.len() {
        let alone = neighbours::findings(&reports, dataset.points.len());
        findings.extend(alone.into_iter().filter(|of| !of.view.as_ref().is_some_and(|view| away.contains(view))));
    }
    findings.extend(poses::scale(dataset));
    findings.extend(surroundings::findings(dataset)?);
    // Cube faces look in other directions than their neighbours: sky is smooth, and no other photo shows it.
    let windows = windows(scene, lookup)?;
    let is_face = |name: &String| windows.get(name).is_some_and(|window| window.photo != window.name);
    findings.retain(|of| {
        !matches!(of.fault, CaptureProblem::Blur | CaptureProblem::Alone) || !of.view.as_ref().is_some_and(is_face)
    });
    let mut findings = finding::joined(findings, views.len());
    findings.extend(dataset.flaws.iter().map(finding::from_scene_problem));
    // If the frame does not fit, the missing points have the same cause.
    let has_frame = findings.iter().any(|of| of.fault == CaptureProblem::Frame);
    let follows = |of: &Finding| {
        of.view.is_none()
            && matches!(of.fault, CaptureProblem::Behind | CaptureProblem::Alone | CaptureProblem::Reprojection)
    };
    findings.retain(|of| !(has_frame && follows(of)));
    findings.sort_by_key(|of| of.fault);
    let known = || reports.iter().filter_map(|view| view.gain);
    let (least, most) = (known().fold(f64::INFINITY, f64::min), known().fold(0.0, f64::max));
    let photo_of = |view: &&View| windows.get(&view.name).map_or(&view.name, |window| &window.photo).clone();
    Ok(Report {
        extent: dataset.extent(),
        photos: views.iter().map(photo_of).collect::<BTreeSet<_>>().len(),
        points: dataset.points.len(),
        reprojection: median(places.iter().filter_map(|places| places.error)),
        gain_spread: (most > 0.0).then(|| most / least),
        views: reports,
        findings,
    })
}
