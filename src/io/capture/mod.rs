//! Scans a capture for what spoils a training: wrong poses, blurred photos, changing exposure or tint, photos without
//! neighbours, an odd scale. Each finding names its cure.

mod gains;
mod neighbours;
mod photos;
mod poses;

use super::colmap::Seen;
use super::listed_path::Place;
use super::listing::Listed;
use super::lookup::Lookup;
use super::recipe::at_photo_size;
use super::window::{Window, windows};
use super::{colmap, folder_of};
use crate::error::Result;
use crate::scene::median::median;
use crate::scene::{Dataset, View};
use glam::{DVec2, DVec3};
use serde::Serialize;
use std::cell::OnceCell;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// A kind of fault in a capture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Fault {
    /// Points are far from where the photo shows them.
    Reprojection,
    /// The photo is less sharp than those beside it.
    Blur,
    /// The photo is brighter or darker than the mean photo, by the points that photos share.
    Exposure,
    /// The photo has another tint than the mean photo, by the points that photos share.
    WhiteBalance,
    /// Hardly any point of the photo is seen by others.
    Alone,
    /// Sizes or distances that training cannot handle well.
    Scale,
}

impl Fault {
    /// Returns the display name.
    pub fn text(self) -> &'static str {
        match self {
            Self::Reprojection => "reprojection",
            Self::Blur => "blur",
            Self::Exposure => "exposure",
            Self::WhiteBalance => "white balance",
            Self::Alone => "alone",
            Self::Scale => "scale",
        }
    }

    /// Returns what to do about it.
    pub fn cure(self) -> &'static str {
        match self {
            Self::Reprojection => "leave the photo out, or adjust the reconstruction again",
            Self::Blur => "leave the photo out",
            Self::Exposure | Self::WhiteBalance => {
                "train gains of each photo (exposure), or take photos with fixed exposure and white balance"
            }
            Self::Alone => "leave the photo out, or add photos between it and the others",
            Self::Scale => "scale and centre the reconstruction, or remove stray points",
        }
    }
}

/// A fault of a capture.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// Kind.
    pub fault: Fault,
    /// Name of the photo, if the fault is that of one.
    pub view: Option<String>,
    /// Description with numbers.
    pub text: String,
    /// What to do about it.
    pub cure: &'static str,
}

impl Finding {
    fn new(fault: Fault, view: Option<&str>, text: String) -> Self {
        Self { fault, view: view.map(str::to_owned), text, cure: fault.cure() }
    }
}

/// What a scan measures of a photo.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ViewReport {
    /// Name of the photo.
    pub name: String,
    /// Points that it shows.
    pub points: usize,
    /// Points that it shows and at least two others show too.
    pub shared: usize,
    /// Median distance of its points from where the photo shows them, px; none without observations.
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
    fn read(scene: &Path, lookup: &Lookup) -> Result<Self> {
        // Opening the scene has checked its paths.
        let lookup = Lookup { allow_outside: true, ..lookup.clone() };
        let photos = colmap::observations(&Place::new(folder_of(scene), &lookup))?.unwrap_or_default();
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
pub(crate) struct Sightings<'a> {
    scene: &'a Path,
    lookup: &'a Lookup,
    dataset: &'a Dataset,
    read: OnceCell<Sighted>,
}

struct Sighted {
    /// Index of the point and pixel, for each view.
    seen: Vec<Vec<(usize, DVec2)>>,
    /// The reconstruction says so; else they are all points in the picture.
    is_observed: Vec<bool>,
}

impl<'a> Sightings<'a> {
    /// Those of a scene that was read.
    pub(crate) fn new((scene, lookup): (&'a Path, &'a Lookup), dataset: &'a Dataset) -> Self {
        Self { scene, lookup, dataset, read: OnceCell::new() }
    }

    fn sighted(&self) -> Result<&Sighted> {
        if let Some(read) = self.read.get() {
            return Ok(read);
        }
        let looked = Observed::read(self.scene, self.lookup)?;
        let views: Vec<&View> = self.dataset.train.iter().collect();
        let observed: Vec<_> = views.iter().map(|view| looked.of(view)).collect();
        let seen = neighbours::seen(&views, &self.dataset.points, &observed);
        let is_observed = observed.iter().map(|of| of.is_some_and(|(_, shown)| !shown.is_empty())).collect();
        Ok(self.read.get_or_init(|| Sighted { seen, is_observed }))
    }

    /// Returns how bright each training photo is relative to the mean of all, by the points that they share: factors of
    /// red, green and blue, or `None` with too few such points.
    pub(crate) fn gains(&self) -> Result<Vec<Option<[f64; 3]>>> {
        if self.dataset.points.is_empty() {
            return Ok(vec![None; self.dataset.train.len()]);
        }
        let views: Vec<&View> = self.dataset.train.iter().collect();
        let gains = gains::gains(&views, &self.sighted()?.seen, &self.dataset.points)?;
        Ok(gains.into_iter().map(|of| of.map(|of| of.channels)).collect())
    }

    /// Returns pixel and place of the points that each training photo shows. There are none where the reconstruction does
    /// not say which photo shows which point.
    pub(crate) fn points(&self) -> Result<Vec<Vec<(DVec2, DVec3)>>> {
        let Sighted { seen, is_observed } = self.sighted()?;
        let place = |&(index, at): &(usize, DVec2)| (at, self.dataset.points[index].position);
        let of_view = |(seen, &is_observed): (&Vec<_>, &bool)| match is_observed {
            true => seen.iter().map(place).collect(),
            false => Vec::new(),
        };
        Ok(seen.iter().zip(is_observed).map(of_view).collect())
    }
}

/// Scans a scene that was read with its photos.
pub fn scan(scene: &Path, lookup: &Lookup, dataset: &Dataset) -> Result<Report> {
    let looked = Observed::read(scene, lookup)?;
    let views: Vec<&View> = dataset.all();
    let observed: Vec<_> = views.iter().map(|view| looked.of(view)).collect();
    let seen = neighbours::seen(&views, &dataset.points, &observed);
    let shared = neighbours::shared(&seen, dataset.points.len());
    let errors: Vec<Option<f64>> = observed.iter().map(|of| of.and_then(poses::error)).collect();
    let sharpness = photos::sharpness(&views)?;
    let gains = gains::gains(&views, &seen, &dataset.points)?;
    let reports: Vec<ViewReport> = (0..views.len())
        .map(|index| ViewReport {
            name: views[index].name.clone(),
            points: seen[index].len(),
            shared: shared[index],
            reprojection: errors[index],
            sharpness: sharpness[index],
            gain: gains[index].map(|of| of.grey),
            channel_gains: gains[index].map(|of| of.channels),
        })
        .collect();
    let mut findings = poses::findings(&reports);
    findings.extend(photos::findings(&reports));
    findings.extend(neighbours::findings(&reports, dataset.points.len()));
    findings.extend(poses::scale(dataset));
    // The faces of a wide photo look at other things than their neighbours: sky is smooth, and no other photo shows it.
    let windows = windows(scene, lookup)?;
    let is_face = |name: &String| windows.get(name).is_some_and(|window| window.photo != window.name);
    findings.retain(|of| !matches!(of.fault, Fault::Blur | Fault::Alone) || !of.view.as_ref().is_some_and(is_face));
    findings.sort_by(|a, b| (a.fault, &a.view).cmp(&(b.fault, &b.view)));
    let known = || reports.iter().filter_map(|view| view.gain);
    let (least, most) = (known().fold(f64::INFINITY, f64::min), known().fold(0.0, f64::max));
    let photo_of = |view: &&View| windows.get(&view.name).map_or(&view.name, |window| &window.photo).clone();
    Ok(Report {
        extent: dataset.extent(),
        photos: views.iter().map(photo_of).collect::<BTreeSet<_>>().len(),
        points: dataset.points.len(),
        reprojection: median(errors.into_iter().flatten()),
        gain_spread: (most > 0.0).then(|| most / least),
        views: reports,
        findings,
    })
}
