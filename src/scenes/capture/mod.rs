//! Scans a capture for what spoils a training: wrong poses, blurred photos, changing exposure or tint, photos without
//! neighbours, an odd scale. Each finding names its cure.

mod finding;
mod gains;
mod neighbours;
mod photos;
mod poses;
mod shown;
mod surroundings;

use super::colmap::{self, Seen};
use super::listed_path::Place;
use super::listing::Listed;
use super::lookup::Lookup;
use super::pose_convention::Native;
use super::recipe::at_photo_size;
use super::window::{Window, windows};
use glam::{DVec2, DVec3};
use labelgs_scene::median::median;
use labelgs_scene::stage::Stage;
use labelgs_scene::{Dataset, Result, View};
use poses::Places;
use serde::Serialize;
use shown::{Mark, Shown};
use std::cell::OnceCell;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

pub use finding::{Fault, Finding};
pub use surroundings::{still_share, text as surroundings_text};

/// What a scan measures of a photo.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ViewReport {
    /// Name of the photo.
    pub name: String,
    /// Points that it shows.
    pub points: usize,
    /// Points that it shows and at least two others show too.
    pub shared: usize,
    /// Points that the reconstruction lists for it and that no camera with its pose can show: they lie behind it.
    pub behind: usize,
    /// Median distance of its points from where the photo shows them, px; none without observations, or if half of them lie
    /// behind the camera.
    pub reprojection: Option<f64>,
    /// Sharpness relative to the photos beside it; none without a photo.
    pub sharpness: Option<f64>,
    /// Brightness relative to the mean of all photos, by the points that they share; none with too few of them.
    pub gain: Option<f64>,
    /// The same of red, green and blue.
    pub channel_gains: Option<[f64; 3]>,
}

/// The result of a scan.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// Radius of the cameras around their mean, times 1.1, world units.
    pub extent: f64,
    /// Number of photos. Those of wide lenses have several views.
    pub photos: usize,
    /// Points of the reconstruction.
    pub points: usize,
    /// Median of the photos' reprojection errors, px.
    pub reprojection: Option<f64>,
    /// Largest gain of a photo over the smallest.
    pub gain_spread: Option<f64>,
    /// All views, by name.
    pub views: Vec<ViewReport>,
    /// Faults, by kind and photo.
    pub findings: Vec<Finding>,
}

/// What the reconstruction says of each photo: which points it shows.
struct Observed {
    photos: BTreeMap<String, (Listed, Vec<Seen>)>,
    /// Photo of each face of a photo through a wide lens.
    faces: BTreeMap<String, String>,
}

impl Observed {
    fn read(dataset: &Dataset, lookup: &Lookup) -> Result<Self> {
        let _stage = Stage::new("reading which photo shows which point", 0);
        // Opening the scene has checked its paths.
        let lookup = Lookup { allow_outside: true, ..lookup.clone() };
        let mut photos = colmap::observations(&Place::new(&dataset.root, &lookup), &dataset.source)?;
        photos.values_mut().for_each(|(listed, _)| lookup.poses.apply(Native::COLMAP, &mut listed.camera));
        let mut faces = BTreeMap::new();
        for (listed, _) in photos.values().filter(|(listed, _)| !listed.lens.is_pinhole()) {
            // It has left out unreadable photos too.
            let Ok(camera) = at_photo_size(listed) else { continue };
            let views = Window::all(&listed.name, &camera, &listed.lens);
            faces.extend(views.into_iter().map(|view| (view.name, view.photo)));
        }
        Ok(Self { photos, faces })
    }

    fn of(&self, view: &View) -> Option<&(Listed, Vec<Seen>)> {
        self.photos.get(self.faces.get(&view.name).unwrap_or(&view.name))
    }
}

/// Which points of the reconstruction each training photo shows. They are read when something asks for them, and once.
pub struct Sightings<'a> {
    lookup: &'a Lookup,
    dataset: &'a Dataset,
    shown: OnceCell<Shown<'a>>,
}

impl<'a> Sightings<'a> {
    /// Those of a scene that was read.
    pub fn new(lookup: &'a Lookup, dataset: &'a Dataset) -> Self {
        Self { lookup, dataset, shown: OnceCell::new() }
    }

    fn shown(&self) -> Result<&Shown<'a>> {
        if let Some(shown) = self.shown.get() {
            return Ok(shown);
        }
        let looked = Observed::read(self.dataset, self.lookup)?;
        let shown = Shown::new(self.dataset.train.iter().collect(), &self.dataset.points, &looked);
        Ok(self.shown.get_or_init(|| shown))
    }

    /// Returns how bright each training photo is relative to the mean of all, by the points that they share: factors of
    /// red, green and blue, or `None` with too few such points.
    pub fn gains(&self) -> Result<Vec<Option<[f64; 3]>>> {
        if self.dataset.points.is_empty() {
            return Ok(vec![None; self.dataset.train.len()]);
        }
        let views: Vec<&View> = self.dataset.train.iter().collect();
        let gains = gains::gains(&views, self.shown()?)?;
        Ok(gains.into_iter().map(|of| of.map(|of| of.channels)).collect())
    }

    /// Returns pixel and place of the points that each training photo shows. There are none where the reconstruction does
    /// not say which photo shows which point.
    pub fn points(&self) -> Result<Vec<Vec<(DVec2, DVec3)>>> {
        let place = |&(index, at): &Mark| (at, self.dataset.points[index].position);
        let of_view = |marks: &Option<Vec<Mark>>| marks.iter().flatten().map(place).collect();
        Ok(self.shown()?.listed().iter().map(of_view).collect())
    }
}

/// Scans a scene that was read with its photos.
pub fn scan(scene: &Path, lookup: &Lookup, dataset: &Dataset) -> Result<Report> {
    let looked = Observed::read(dataset, lookup)?;
    let views: Vec<&View> = dataset.all();
    let shown = Shown::new(views.clone(), &dataset.points, &looked);
    let counts = shown.counts();
    let places: Vec<Places> =
        views.iter().map(|view| looked.of(view).map_or_else(Places::default, Places::of)).collect();
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
    // A photo that looks away from its points shares none, and others share few with it: one fault is one finding.
    let away: BTreeSet<String> =
        findings.iter().filter(|of| of.fault == Fault::Behind).filter_map(|of| of.view.clone()).collect();
    if 2 * away.len() <= views.len() {
        let alone = neighbours::findings(&reports, dataset.points.len());
        findings.extend(alone.into_iter().filter(|of| !of.view.as_ref().is_some_and(|view| away.contains(view))));
    }
    findings.extend(poses::scale(dataset));
    findings.extend(surroundings::findings(dataset)?);
    // The faces of a wide photo look at other things than their neighbours: sky is smooth, and no other photo shows it.
    let windows = windows(scene, lookup)?;
    let is_face = |name: &String| windows.get(name).is_some_and(|window| window.photo != window.name);
    findings.retain(|of| !matches!(of.fault, Fault::Blur | Fault::Alone) || !of.view.as_ref().is_some_and(is_face));
    let mut findings = finding::joined(findings, views.len());
    findings.extend(dataset.flaws.iter().map(finding::of_flaw));
    // Points that most photos do not show are one fault with a frame that does not fit.
    let has_frame = findings.iter().any(|of| of.fault == Fault::Frame);
    let follows =
        |of: &Finding| of.view.is_none() && matches!(of.fault, Fault::Behind | Fault::Alone | Fault::Reprojection);
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
