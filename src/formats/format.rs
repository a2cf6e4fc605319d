//! The interface of model file formats.

use crate::transform::Transform;
use glam::DVec3;
use labelgs_files::label_table::LabelTable;
use labelgs_scene::{Gaussians, Result};
use serde::{Deserialize, Serialize};
use std::io::{self, Write};
use std::path::Path;

/// The content of a model file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReadModel {
    /// The usable Gaussians.
    pub gaussians: Gaussians,
    /// Names of the labels, if the file itself contains them.
    pub names: Option<LabelTable>,
    /// Number of Gaussians omitted because they cannot be rendered.
    pub dropped: u64,
    /// Notes for the user, one per line.
    pub notes: Vec<String>,
    /// Initial view of the model, if the file has one.
    pub first_view: Option<FirstView>,
}

/// How labels are written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum LabelType {
    /// Write float properties to a PLY; every reader of 3DGS files accepts them.
    #[default]
    Float,
    /// Write unsigned integers to a PLY; some programs refuse or misread such files.
    Uint,
    /// Write no labels and no names, in any format.
    None,
}

/// Version of an SPZ file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum SpzVersion {
    /// A gzip stream; most viewers read it.
    #[default]
    #[serde(rename = "3")]
    #[cfg_attr(feature = "cli", value(name = "3"))]
    V3,
    /// A Zstandard stream per attribute; smaller.
    #[serde(rename = "4")]
    #[cfg_attr(feature = "cli", value(name = "4"))]
    V4,
}

/// Options for writing model files.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WriteOptions {
    /// How labels are written.
    pub label_type: LabelType,
    /// Version of SPZ files.
    pub spz_version: SpzVersion,
    /// Initial view, for formats that can store it. Without it, a page shows the model from above, with y down.
    pub first_view: Option<FirstView>,
}

/// The initial view of a model, and its up direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FirstView {
    /// Unit vector that points up in the world.
    pub up: DVec3,
    /// Position of the eye in the world.
    pub eye: DVec3,
}

impl FirstView {
    /// Creates a view from the numbers in a file, or returns `None` if they are invalid.
    pub(crate) fn checked(up: DVec3, eye: DVec3) -> Option<Self> {
        let up = up.try_normalize().filter(|_| eye.as_vec3().is_finite());
        up.map(|up| Self { up, eye })
    }

    /// Returns the view of the transformed model.
    pub fn moved(self, by: &Transform) -> Self {
        Self { up: by.turn * self.up, eye: by.place(self.eye) }
    }
}

/// A model that is being written to a file.
#[derive(Clone, Copy, Debug)]
pub struct Export<'a> {
    /// The model; its columns have equal lengths.
    pub model: &'a Gaussians,
    /// The rows to write, all finite.
    pub rows: &'a [usize],
    /// Names of the labels.
    pub names: Option<&'a LabelTable>,
    /// World position of the file's (0, 0, 0): 0 unless 32-bit world positions would be rounded.
    pub origin: DVec3,
    /// Options.
    pub options: WriteOptions,
    /// Title of a page: its file name without the extension.
    pub title: &'a str,
}

impl<'a> Export<'a> {
    /// Creates an export of the finite rows.
    pub fn new(model: &'a Gaussians, rows: &'a [usize], names: Option<&'a LabelTable>, options: WriteOptions) -> Self {
        let is_rounded = |&row: &usize| model.world(row) != model.world(row).as_vec3().as_dvec3();
        let is_far = model.origin != DVec3::ZERO && rows.iter().any(is_rounded);
        Self { model, rows, names, origin: if is_far { model.origin } else { DVec3::ZERO }, options, title: "" }
    }

    /// Returns a position relative to the file's origin.
    pub fn position(&self, row: usize) -> [f32; 3] {
        if self.origin == DVec3::ZERO { self.model.world(row).as_vec3().to_array() } else { self.model.means[row] }
    }

    /// Returns the labels, unless labels are not written.
    pub fn labels(&self) -> Option<&'a [u32]> {
        self.model.labels.as_deref().filter(|_| self.options.label_type != LabelType::None)
    }

    /// Returns the label confidences, if labels are written.
    pub fn label_confidence(&self) -> Option<&'a [f32]> {
        self.labels().and(self.model.label_confidence.as_deref())
    }
}

/// A model file format.
#[derive(Clone, Copy, Debug)]
pub struct ModelFormat {
    /// Display name.
    pub name: &'static str,
    /// File extensions: lower case, with the dot.
    pub extensions: &'static [&'static str],
    /// What [`Content::what`](labelgs_files::content::Content::what) may say about files of this format.
    pub contents: &'static [&'static str],
    /// Reads a file through `labelgs_files::read`.
    pub read: fn(&Path) -> Result<ReadModel>,
    /// Writes a file; `None` if the format is read-only.
    pub write: Option<ModelWriter>,
}

/// How to write files of a format.
#[derive(Clone, Copy, Debug)]
pub struct ModelWriter {
    /// Returns what the file cannot store, one note per line, or an error if it cannot store the model at all. Runs
    /// before the file is opened.
    pub losses: fn(&Export) -> Result<Vec<String>>,
    /// Writes the rows of an export.
    pub write: fn(&Export, &mut dyn Write) -> io::Result<()>,
    /// Returns a checksum of the positions in the file. With a checksum, [`super::export_model`] also writes the labels
    /// beside the file, in case another program drops them from the file.
    pub checksum: Option<fn(&Export) -> u32>,
}
