//! A model that need not be entirely in memory.

use super::{FirstView, ReadModel, Row, StoredModel, open_stored, read_model};
use glam::DVec3;
use labelgs_files::label_table::LabelTable;
use labelgs_scene::{Gaussians, Result};
use std::borrow::Cow;
use std::path::Path;

/// A model in its file, or in memory if its format requires reading it whole.
#[derive(Clone, Debug)]
pub enum LazyModel {
    /// In its file.
    Stored(StoredModel),
    /// In memory.
    Whole(ReadModel),
}

impl LazyModel {
    /// Opens a model.
    pub fn open(path: &Path) -> Result<Self> {
        match open_stored(path)? {
            Some(stored) => Ok(Self::Stored(stored)),
            None => read_model(path).map(Self::Whole),
        }
    }

    /// Returns the names of the labels, if the file contains them.
    pub fn names(&self) -> Option<&LabelTable> {
        match self {
            Self::Stored(_) => None,
            Self::Whole(read) => read.names.as_ref(),
        }
    }

    /// Returns the initial view, if the file has one.
    pub fn first_view(&self) -> Option<FirstView> {
        match self {
            Self::Stored(stored) => stored.first_view,
            Self::Whole(read) => read.first_view,
        }
    }

    /// Returns access to the model row by row.
    pub fn view(&self) -> ModelRef<'_> {
        match self {
            Self::Stored(stored) => ModelRef::Stored(stored),
            Self::Whole(read) => ModelRef::Whole(&read.gaussians),
        }
    }
}

/// A model in its file or in memory, read row by row. Row numbers have gaps where a row of a file cannot be rendered.
#[derive(Clone, Copy, Debug)]
pub enum ModelRef<'a> {
    /// In its file.
    Stored(&'a StoredModel),
    /// In memory.
    Whole(&'a Gaussians),
}

impl<'a> From<&'a Gaussians> for ModelRef<'a> {
    fn from(model: &'a Gaussians) -> Self {
        Self::Whole(model)
    }
}

impl<'a> ModelRef<'a> {
    /// Reads the whole model.
    pub fn read(self) -> Result<Cow<'a, Gaussians>> {
        match self {
            Self::Stored(stored) => Ok(Cow::Owned(read_model(&stored.path)?.gaussians)),
            Self::Whole(model) => Ok(Cow::Borrowed(model)),
        }
    }

    /// Returns the number of rows; for a file, including those that cannot be rendered.
    pub fn count(self) -> u64 {
        match self {
            Self::Stored(stored) => stored.count,
            Self::Whole(model) => model.len() as u64,
        }
    }

    /// Returns the degree of the spherical harmonics.
    pub fn sh_degree(self) -> u32 {
        match self {
            Self::Stored(stored) => stored.sh_degree,
            Self::Whole(model) => model.sh_degree,
        }
    }

    /// Returns true if the Gaussians have labels.
    pub fn has_labels(self) -> bool {
        match self {
            Self::Stored(stored) => stored.has_labels,
            Self::Whole(model) => model.labels.is_some(),
        }
    }

    /// Returns the world position of (0, 0, 0).
    pub fn origin(self) -> DVec3 {
        match self {
            Self::Stored(stored) => stored.origin,
            Self::Whole(model) => model.origin,
        }
    }

    /// Calls `see` with the number and values of each renderable row, in order. Returns notes for the user.
    pub fn scan(self, mut see: impl FnMut(u64, &Row)) -> Result<Vec<String>> {
        let model = match self {
            Self::Stored(stored) => return stored.scan(see),
            Self::Whole(model) => model,
        };
        for row in 0..model.len() {
            let values = Row {
                position: model.means[row].map(f64::from),
                quat: model.quats[row].map(f64::from),
                scale: model.scales[row],
                opacity: model.opacities[row],
                sh0: model.sh0[row],
                rest: model.rest(row),
                label: model.labels.as_ref().map(|labels| labels[row]),
                confidence: model.label_confidence.as_ref().map(|shares| shares[row]),
            };
            see(row as u64, &values);
        }
        Ok(Vec::new())
    }

    /// Returns rows by their sorted numbers, as a model relative to `far`. Rows of a model in memory keep its origin.
    pub fn rows(self, numbers: impl Iterator<Item = u64>, far: DVec3) -> Result<Gaussians> {
        match self {
            Self::Stored(stored) => stored.rows(numbers, far),
            Self::Whole(model) => Ok(model.picked(&numbers.map(|number| number as usize).collect::<Vec<_>>())),
        }
    }
}
