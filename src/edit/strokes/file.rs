//! Strokes over photos, and their file.

use labelgs_files::read;
use labelgs_scene::{Error, MODEL_LABEL_MAX, Result, UNLABELLED};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Version of the layout.
const SCHEMA_VERSION: u32 = 1;
/// Most strokes of a file.
const STROKES_MAX: usize = 10_000;
/// Most objects of a file.
const OBJECTS_MAX: usize = 256;
/// Most points of a stroke.
const POINTS_MAX: usize = 10_000;
/// Largest radius, px.
const RADIUS_MAX: f64 = 100.0;

/// A line over a photo, on an object or on its background.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stroke {
    /// Name of the view, with or without its extension.
    pub view: String,
    /// Corners of the line, or a single point, px from the upper left corner of the photo: `[3, 0]` is in the fourth
    /// pixel of the first row.
    pub points: Vec<[f64; 2]>,
    /// How far the stroke reaches to each side of its line, px.
    #[serde(default)]
    pub radius: f64,
    /// Label of the object; 0 for the background.
    pub label: u32,
    /// Name of the object.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// False if the stroke marks what does not belong to the object.
    #[serde(default = "default_on")]
    pub on: bool,
}

fn default_on() -> bool {
    true
}

impl Stroke {
    /// Returns the pixels of the stroke in a photo of `width` x `height` px, row-major and ascending. A point outside
    /// the photo is an error that gives its number.
    pub fn pixels(&self, (width, height): (u32, u32)) -> std::result::Result<Vec<usize>, String> {
        let is_inside = |[x, y]: [f64; 2]| x >= 0.0 && y >= 0.0 && x < f64::from(width) && y < f64::from(height);
        if let Some(at) = self.points.iter().position(|&point| !is_inside(point)) {
            let [x, y] = self.points[at];
            return Err(format!(
                "point {} ({x}, {y}) is outside of the photo, which has {width} x {height} px",
                at + 1
            ));
        }
        let pixel = |[x, y]: [f64; 2]| [x as i64, y as i64];
        let mut line: BTreeSet<[i64; 2]> = self.points.iter().map(|&point| pixel(point)).collect();
        for ends in self.points.windows(2) {
            let [a, b] = [ends[0], ends[1]];
            let steps = (b[0] - a[0]).abs().max((b[1] - a[1]).abs()).ceil();
            let at = |step: u32| [0, 1].map(|axis| a[axis] + (b[axis] - a[axis]) * f64::from(step) / steps);
            line.extend((1..steps as u32).map(|step| pixel(at(step))));
        }
        let reach = self.radius as i64;
        let within = (-reach..=reach).flat_map(|y| (-reach..=reach).map(move |x| [x, y]));
        let disc: Vec<[i64; 2]> = within.filter(|[x, y]| ((x * x + y * y) as f64) <= self.radius.powi(2)).collect();
        let (width, height) = (i64::from(width), i64::from(height));
        let mut hit = vec![false; (width * height) as usize];
        for [x, y] in line.iter().flat_map(|[x, y]| disc.iter().map(move |[u, v]| [x + u, y + v])) {
            if (0..width).contains(&x) && (0..height).contains(&y) {
                hit[(y * width + x) as usize] = true;
            }
        }
        Ok((0..hit.len()).filter(|&at| hit[at]).collect())
    }

    /// Returns what is wrong with the stroke, if anything.
    fn problem(&self) -> Option<String> {
        if self.points.is_empty() || self.points.len() > POINTS_MAX {
            return Some(format!("has {} points; expected 1 to {POINTS_MAX}", self.points.len()));
        }
        if !(0.0..=RADIUS_MAX).contains(&self.radius) {
            return Some(format!("has a radius of {}; expected 0 to {RADIUS_MAX} px", self.radius));
        }
        if self.label > MODEL_LABEL_MAX {
            return Some(format!("has label {}; labels are from 0, for no object, to {MODEL_LABEL_MAX}", self.label));
        }
        if self.label == UNLABELLED && self.name.is_some() {
            return Some(
                "has a name for label 0, which is no object; leave out the name, or give another label".into(),
            );
        }
        None
    }

    /// Returns true if the stroke is on an object.
    fn is_on_object(&self) -> bool {
        self.on && self.label != UNLABELLED
    }
}

/// Strokes on objects and on their background.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StrokesFile {
    /// Version of the layout.
    pub schema_version: u32,
    /// The strokes. Later ones override earlier ones.
    pub strokes: Vec<Stroke>,
}

impl StrokesFile {
    /// Collects strokes.
    pub fn new(strokes: Vec<Stroke>) -> Self {
        Self { schema_version: SCHEMA_VERSION, strokes }
    }

    /// Reads strokes. At least one must be on an object and one on the background.
    ///
    /// # Errors
    ///
    /// A file of another kind or version; an invalid stroke, with its number from 1.
    pub fn read(path: &Path) -> Result<Self> {
        let expected = "expected {\"schema_version\": 1, \"strokes\": [{\"view\": \"000\", \"points\": [[10, 20], \
                        [30, 20]], \"label\": 1}]}, where \"radius\", \"name\" and \"on\" may be added";
        let file: Self = read::json(path, expected)?;
        read::require_version(path, file.schema_version, SCHEMA_VERSION)?;
        if file.strokes.len() > STROKES_MAX {
            let problem = format!("has {} strokes; at most {STROKES_MAX} are read", file.strokes.len());
            return Err(Error::data(path, "", problem));
        }
        for (stroke, number) in file.strokes.iter().zip(1..) {
            if let Some(problem) = stroke.problem() {
                return Err(Error::data(path, stroke_title(number), problem));
            }
        }
        let objects: BTreeSet<u32> = file.strokes.iter().map(|stroke| stroke.label).collect();
        if objects.len() > OBJECTS_MAX {
            let problem = format!("has strokes of {} labels; at most {OBJECTS_MAX} are cut at once", objects.len());
            return Err(Error::data(path, "", problem));
        }
        if !file.strokes.iter().any(Stroke::is_on_object) {
            return Err(Error::data(path, "", "no stroke is on an object; give at least one a label of 1 or more"));
        }
        if file.strokes.iter().all(Stroke::is_on_object) {
            let problem = "no stroke is on the background; add one with \"label\": 0 beside the objects";
            return Err(Error::data(path, "", problem));
        }
        file.names(path)?;
        Ok(file)
    }

    /// Returns the names of the labels. `path` is the file, for messages.
    ///
    /// # Errors
    ///
    /// Two names for one label, or one name for two labels, with the number of the stroke.
    pub fn names(&self, path: &Path) -> Result<BTreeMap<u32, String>> {
        let mut names: BTreeMap<u32, String> = BTreeMap::new();
        for (stroke, number) in self.strokes.iter().zip(1..) {
            let Some(name) = &stroke.name else { continue };
            let label = stroke.label;
            let other = names.iter().find(|&(&id, known)| (id == label) != (known == name));
            if let Some((id, known)) = other {
                let problem = format!("calls label {label} {name}, and an earlier one calls label {id} {known}");
                return Err(Error::data(path, stroke_title(number), problem));
            }
            names.insert(label, name.clone());
        }
        Ok(names)
    }
}

/// Names a stroke in messages, by its number from 1.
pub fn stroke_title(number: usize) -> String {
    format!("stroke {number}")
}
