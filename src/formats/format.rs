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
    /// Names of the labels, if the file itself holds them.
    pub names: Option<LabelTable>,
    /// Number of Gaussians left out because they cannot be rendered.
    pub dropped: u64,
    /// Notes for the user, a line each.
    pub notes: Vec<String>,
    /// Where to see the model from at first, if the file says it.
    pub first_view: Option<FirstView>,
}

/// How labels are written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum LabelType {
    /// In a PLY as floats, which every reader of 3DGS files skips or keeps.
    #[default]
    Float,
    /// In a PLY as unsigned integers; some readers refuse or misread such a file.
    Uint,
    /// Without labels and names, in every format.
    None,
}

/// Version of an SPZ file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum SpzVersion {
    /// One stream of gzip, which most viewers read.
    #[default]
    #[serde(rename = "3")]
    #[cfg_attr(feature = "cli", value(name = "3"))]
    V3,
    /// A stream of Zstandard for each attribute.
    #[serde(rename = "4")]
    #[cfg_attr(feature = "cli", value(name = "4"))]
    V4,
}

/// Choices for the writers of model files.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WriteOptions {
    /// How labels are written.
    pub label_type: LabelType,
    /// Version of SPZ files.
    pub spz_version: SpzVersion,
    /// Where the model is shown from at first, for formats with a place for it. Without it a page shows the model from above,
    /// with y as down.
    pub first_view: Option<FirstView>,
}

/// Where a model is seen from at first, and upright.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FirstView {
    /// Direction of up in the world, of length 1.
    pub up: DVec3,
    /// Position of the eye in the world.
    pub eye: DVec3,
}

impl FirstView {
    /// Takes both from numbers of a file; `None` for those that are none.
    pub(crate) fn checked(up: DVec3, eye: DVec3) -> Option<Self> {
        let up = up.try_normalize().filter(|_| eye.as_vec3().is_finite());
        up.map(|up| Self { up, eye })
    }

    /// Returns the view of the model at another place.
    pub fn moved(self, by: &Transform) -> Self {
        Self { up: by.turn * self.up, eye: by.place(self.eye) }
    }
}

/// A model on its way into a file.
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
    /// Choices.
    pub options: WriteOptions,
    /// Title of a page: the name of its file, without the extension.
    pub title: &'a str,
}

impl<'a> Export<'a> {
    /// Makes an export of the finite rows.
    pub fn new(model: &'a Gaussians, rows: &'a [usize], names: Option<&'a LabelTable>, options: WriteOptions) -> Self {
        let is_rounded = |&row: &usize| model.world(row) != model.world(row).as_vec3().as_dvec3();
        let is_far = model.origin != DVec3::ZERO && rows.iter().any(is_rounded);
        Self { model, rows, names, origin: if is_far { model.origin } else { DVec3::ZERO }, options, title: "" }
    }

    /// Returns a position relative to the origin of the file.
    pub fn position(&self, row: usize) -> [f32; 3] {
        if self.origin == DVec3::ZERO { self.model.world(row).as_vec3().to_array() } else { self.model.means[row] }
    }

    /// Returns the labels, unless none are to be written.
    pub fn labels(&self) -> Option<&'a [u32]> {
        self.model.labels.as_deref().filter(|_| self.options.label_type != LabelType::None)
    }

    /// Returns the confidences of the labels, if labels are written.
    pub fn label_confidence(&self) -> Option<&'a [f32]> {
        self.labels().and(self.model.label_confidence.as_deref())
    }
}

/// A model file format.
#[derive(Clone, Copy, Debug)]
pub struct ModelFormat {
    /// Display name.
    pub name: &'static str,
    /// Extensions of its files: lower case, with the dot.
    pub endings: &'static [&'static str],
    /// What the first bytes of its files may say that they are.
    pub contents: &'static [&'static str],
    /// Reads a file, through `labelgs_files::read`.
    pub read: fn(&Path) -> Result<ReadModel>,
    /// Writes a file; `None` if the format is only read.
    pub write: Option<ModelWriter>,
}

/// How a format writes files.
#[derive(Clone, Copy, Debug)]
pub struct ModelWriter {
    /// Returns what the file cannot hold, a line each; an error if it cannot hold the model at all. It runs before the
    /// file is opened.
    pub losses: fn(&Export) -> Result<Vec<String>>,
    /// Writes the rows of an export.
    pub write: fn(&Export, &mut dyn Write) -> io::Result<()>,
    /// Returns a checksum of the positions in the file. With it, [`super::export_model`] writes the labels once more
    /// beside the file, for the case that another program drops them from it.
    pub checksum: Option<fn(&Export) -> u32>,
}
