//! Checks each mask by comparing it with the masks of the other photos. This module reads no files.

use super::shortened;
use super::soft_edges::{self, Edges};
use labelgs_scene::median::median;
use labelgs_scene::words::name_of;
use labelgs_scene::{Camera, Dataset, LabelMap, Point, Setting, View};
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};

/// An object whose share of the image border exceeds this value surrounds the image. The value is a little below 1,
/// because the true object may touch the border.
pub const INVERTED_BORDER_MIN: f64 = 0.9;
/// An object whose share of the image exceeds this value covers most of it. Objects of interest rarely do; backgrounds
/// always do.
pub const INVERTED_SHARE_MIN: f64 = 0.5;
/// Largest border share of an id in the other masks for it not to surround the image.
pub const INVERTED_ELSEWHERE_MAX: f64 = 0.5;
/// A mask is nearly empty if its labelled area relative to the median is below this value. Distance and image borders
/// change areas by small factors; lost tracks leave nothing or a few pixels.
pub const EMPTY_MASK_RATIO_MAX: f64 = 0.05;
/// The same for a single object. It is lower, because an object may really show only a sliver behind another.
pub const EMPTY_OBJECT_RATIO_MAX: f64 = 0.005;
/// Fewest masks with an object before one of them is compared with their median.
pub const MEDIAN_VIEWS_MIN: usize = 4;
/// Smallest share of the image that an object must have in both neighbours for its absence between them to count.
/// Smaller objects may really disappear.
pub const BLINK_SHARE_MIN: f64 = 0.002;

/// A kind of problem in masks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Problem {
    /// A photo has no mask.
    Missing,
    /// A file does not belong to any photo.
    Misnamed,
    /// No scale brings the mask to the size of the photo.
    Missized,
    /// The file is not an id mask.
    Unreadable,
    /// Only held-out photos have masks.
    HeldOut,
    /// No mask marks an object.
    NoObject,
    /// Every mask is a single area with a single id.
    OneArea,
    /// Pixels along edges mix the values of both sides.
    SoftEdges,
    /// Object and background seem swapped.
    Inverted,
    /// Much less is labelled than in other masks.
    NearlyEmpty,
    /// Only one mask contains the id.
    SingleView,
    /// An id is missing between two masks that contain it.
    Blink,
}

impl Problem {
    /// Returns the display name.
    pub fn text(self) -> String {
        name_of(&self)
    }
}

/// A suspicious mask or object.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub struct Finding {
    /// Kind of problem.
    pub problem: Problem,
    /// Name of the photo, if the problem concerns one.
    pub view: Option<String>,
    /// Id of the object, if the problem concerns one.
    pub id: Option<u32>,
    /// Description.
    pub text: String,
}

impl Finding {
    /// Creates a finding about the whole scene.
    pub(super) fn of_scene(problem: Problem, text: String) -> Self {
        Self { problem, view: None, id: None, text }
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Area {
    pixels: u64,
    border: u64,
}

/// Measurements of a mask, as needed by the checks.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MaskStats {
    pixels: u64,
    border: u64,
    objects: BTreeMap<u16, Area>,
    edges: Edges,
    /// Id at the projection of each point of the scene; `None` outside the image.
    at_points: Vec<Option<u16>>,
}

impl MaskStats {
    /// Measures a mask. `camera` is the photo's camera at any scale. Lens distortion is ignored, because positions need
    /// only be approximate.
    pub fn new(map: &LabelMap, camera: &Camera, points: &[Point]) -> Self {
        let mut objects: BTreeMap<u16, Area> = BTreeMap::new();
        for run in map.ids.chunk_by(|a, b| a == b).filter(|run| run[0] != 0) {
            objects.entry(run[0]).or_default().pixels += run.len() as u64;
        }
        let (width, height) = (map.width, map.height);
        let rows = [0, height - 1].into_iter().collect::<BTreeSet<u32>>();
        let columns = [0, width - 1].into_iter().collect::<BTreeSet<u32>>();
        let horizontal = rows.iter().flat_map(|&y| (0..width).map(move |x| (x, y)));
        let vertical = columns.iter().flat_map(|&x| (1..height.saturating_sub(1)).map(move |y| (x, y)));
        let mut border = 0;
        for (x, y) in horizontal.chain(vertical) {
            border += 1;
            if let Some(area) = objects.get_mut(&map.at(x, y)) {
                area.border += 1;
            }
        }
        let camera = camera.resized(width, height);
        let at = |point: &Point| {
            let own = camera.to_camera(point.position);
            let pixel = camera.project(own);
            let (x, y) = (pixel.x.floor(), pixel.y.floor());
            let inside = own.z > 0.0 && x >= 0.0 && y >= 0.0 && x < f64::from(width) && y < f64::from(height);
            inside.then(|| map.at(x as u32, y as u32))
        };
        let at_points = points.iter().map(at).collect();
        Self {
            pixels: map.ids.len() as u64,
            border,
            objects,
            edges: Edges::measure(&map.ids, width, height),
            at_points,
        }
    }

    /// Returns the ids in the mask.
    pub fn ids(&self) -> impl Iterator<Item = u32> {
        self.objects.keys().map(|&id| u32::from(id))
    }

    fn share(&self, id: u16) -> f64 {
        self.objects.get(&id).map_or(0.0, |area| area.pixels as f64 / self.pixels as f64)
    }

    fn border_share(&self, id: u16) -> f64 {
        self.objects.get(&id).map_or(0.0, |area| area.border as f64 / self.border as f64)
    }

    fn labelled(&self) -> f64 {
        self.objects.values().map(|area| area.pixels).sum::<u64>() as f64 / self.pixels as f64
    }
}

/// Checks masks, given with the names of their photos and sorted by name. A problem that all masks share is reported
/// alone, because it causes many others.
pub fn findings(masks: &[(&str, &MaskStats)]) -> Vec<Finding> {
    if let Some((problem, text)) = problem_of_all(masks) {
        return vec![Finding::of_scene(problem, text)];
    }
    let ids: BTreeSet<u16> = masks.iter().flat_map(|(_, look)| look.objects.keys().copied()).collect();
    let mut found = nearly_empty_masks(masks);
    for &id in &ids {
        found.extend(inverted(masks, id, ids.len() == 1));
        found.extend(nearly_empty_objects(masks, id));
        found.extend(single_view(masks, id));
        found.extend(blinks(masks, id));
    }
    found.sort();
    found
}

fn problem_of_all(masks: &[(&str, &MaskStats)]) -> Option<(Problem, String)> {
    let (_, first) = masks.first()?;
    if masks.iter().all(|(_, look)| look.objects.is_empty()) {
        return Some((Problem::NoObject, no_object(masks.len())));
    }
    if let Some((&id, _)) = first.objects.first_key_value()
        && masks.iter().all(|(_, look)| look.objects.get(&id).is_some_and(|area| area.pixels == look.pixels))
    {
        return Some((Problem::OneArea, one_area(masks.len(), id)));
    }
    let edges: Vec<(&str, &Edges)> = masks.iter().map(|(name, look)| (*name, &look.edges)).collect();
    soft_edges::problem(&edges).map(|text| (Problem::SoftEdges, text))
}

/// Describes masks of which none marks an object.
pub fn no_object(masks: usize) -> String {
    format!(
        "no mask marks an object: every pixel of all {masks} masks is 0. Make the masks again with an id above 0 for each \
         object, and look whether the program that wrote them found anything, or wrote ids that were divided by 255"
    )
}

/// Describes masks that are a single area.
pub fn one_area(masks: usize, id: u16) -> String {
    format!(
        "no mask separates an object from its surroundings: every pixel of all {masks} masks is {id}. Make the masks \
         again with 0 where no object is"
    )
}

/// Describes the problem if only held-out photos have masks. `has_mask` applies to photos for training and held-out
/// photos.
pub fn held_out(dataset: &Dataset, has_mask: impl Fn(&View) -> bool) -> Option<String> {
    if dataset.train.iter().any(&has_mask) {
        return None;
    }
    let photos: Vec<&str> = dataset.test.iter().filter(|view| has_mask(view)).map(|view| view.name.as_str()).collect();
    let text = || {
        format!(
            "only held-out photos have masks, so training cannot use them: {}. Add masks of other \
             photos, or hold out others by {} of the training",
            shortened(&photos),
            Setting("test_every")
        )
    };
    (!photos.is_empty()).then(text)
}

fn finding(problem: Problem, view: &str, id: Option<u16>, text: String) -> Finding {
    Finding { view: Some(view.to_owned()), id: id.map(u32::from), ..Finding::of_scene(problem, text) }
}

fn percent(share: f64) -> String {
    format!("{:.2} %", share * 100.0)
}

/// Finds masks in which an id surrounds and fills the image, although the id does not do so in the other masks or is
/// the only one. A scene has the same floor or wall in most views, so an object that surrounds only one photo is its
/// background.
fn inverted(masks: &[(&str, &MaskStats)], id: u16, only: bool) -> Vec<Finding> {
    let with: Vec<&(&str, &MaskStats)> = masks.iter().filter(|(_, look)| look.objects.contains_key(&id)).collect();
    let surrounds =
        |look: &MaskStats| look.border_share(id) >= INVERTED_BORDER_MIN && look.share(id) >= INVERTED_SHARE_MIN;
    let elsewhere = |own: &str| {
        let others = with.iter().filter(|(name, _)| *name != own).map(|(_, look)| look.border_share(id));
        median(others).is_some_and(|share| share <= INVERTED_ELSEWHERE_MAX)
    };
    let found = with.iter().filter(|(name, look)| surrounds(look) && (only || elsewhere(name)));
    let text = |look: &MaskStats| {
        let (share, border) = (percent(look.share(id)), percent(look.border_share(id)));
        let unlike = if only { "it is the only object" } else { "it does not surround the image in the other masks" };
        format!("covers {share} of the image and {border} of its border, and {unlike}: object and background swapped?")
    };
    found.map(|(name, look)| finding(Problem::Inverted, name, Some(id), text(look))).collect()
}

fn nearly_empty_masks(masks: &[(&str, &MaskStats)]) -> Vec<Finding> {
    let usual = median(masks.iter().map(|(_, look)| look.labelled())).unwrap_or(0.0);
    let few = |look: &MaskStats| look.labelled() < usual * EMPTY_MASK_RATIO_MAX;
    let text = |look: &MaskStats| {
        format!("{} of the image is labelled; the median is {}", percent(look.labelled()), percent(usual))
    };
    let found = masks.iter().filter(|(_, look)| few(look));
    found.map(|(name, look)| finding(Problem::NearlyEmpty, name, None, text(look))).collect()
}

fn nearly_empty_objects(masks: &[(&str, &MaskStats)], id: u16) -> Vec<Finding> {
    let with: Vec<(&str, f64)> =
        masks.iter().map(|(name, look)| (*name, look.share(id))).filter(|(_, share)| *share > 0.0).collect();
    if with.len() < MEDIAN_VIEWS_MIN {
        return Vec::new();
    }
    let usual = median(with.iter().map(|(_, share)| *share)).unwrap_or(0.0);
    let few = with.into_iter().filter(|(_, share)| *share < usual * EMPTY_OBJECT_RATIO_MAX);
    let text = |share| format!("covers {} of the image; the median is {}", percent(share), percent(usual));
    few.map(|(name, share)| finding(Problem::NearlyEmpty, name, Some(id), text(share))).collect()
}

fn single_view(masks: &[(&str, &MaskStats)], id: u16) -> Option<Finding> {
    let mut with = masks.iter().filter(|(_, look)| look.objects.contains_key(&id));
    let (name, look) = with.next()?;
    let text = || {
        let (share, masks) = (percent(look.share(id)), masks.len());
        format!("occurs only in this mask of {masks}, with {share} of it: an object that changed its id?")
    };
    (masks.len() > 1 && with.next().is_none()).then(|| finding(Problem::SingleView, name, Some(id), text()))
}

/// Finds masks without an object that both neighbours by name show. Scene points on the object in both neighbours can
/// excuse the absence: none of them is inside the image, or most of those inside are on other objects that both
/// neighbours also show and that may hide the object.
fn blinks(masks: &[(&str, &MaskStats)], id: u16) -> Vec<Finding> {
    let shown = |look: &MaskStats| look.share(id) >= BLINK_SHARE_MIN;
    let blinking = masks.windows(3).filter(|three| {
        let [(_, before), (_, between), (_, after)] = three else { return false };
        let absent = !between.objects.contains_key(&id);
        absent && shown(before) && shown(after) && !excused(before, between, after, id)
    });
    let text = |before: &str, after: &str| format!("is absent here and present in {before} and {after}");
    blinking.map(|three| finding(Problem::Blink, three[1].0, Some(id), text(three[0].0, three[2].0))).collect()
}

fn excused(before: &MaskStats, between: &MaskStats, after: &MaskStats, id: u16) -> bool {
    let sides = before.at_points.iter().zip(&after.at_points);
    let on_object = sides.zip(&between.at_points).filter(|((a, b), _)| **a == Some(id) && **b == Some(id));
    let between: Vec<Option<u16>> = on_object.map(|(_, between)| *between).collect();
    let inside: Vec<u16> = between.iter().copied().flatten().collect();
    let known = |other: &&u16| before.objects.contains_key(other) && after.objects.contains_key(other);
    let behind = inside.iter().filter(known).count();
    // Without points on the object, nothing excuses the absence.
    !between.is_empty() && (inside.is_empty() || behind * 2 > inside.len())
}
