//! `edits.json`: the edits of a model, for replay.

use super::{Document, Edit, Sights};
use labelgs_files::{atomic, read};
use labelgs_scene::words::counted;
use labelgs_scene::{Error, Gaussians, Result};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Version of the layout.
const SCHEMA_VERSION: u32 = 1;

/// The edits of a model, first to last.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EditsFile {
    /// Version of the layout.
    pub schema_version: u32,
    /// Number of Gaussians in the original model.
    pub gaussians: u64,
    /// CRC-32 of their positions and labels.
    pub checksum: u32,
    /// The edits.
    pub edits: Vec<Edit>,
}

impl EditsFile {
    /// Records the edits of a model.
    pub fn new(first: &Gaussians, edits: Vec<Edit>) -> Self {
        Self { schema_version: SCHEMA_VERSION, gaussians: first.len() as u64, checksum: checksum(first), edits }
    }

    /// Reads the file.
    ///
    /// # Errors
    ///
    /// A file that is not an `edits.json`, or has another version.
    pub fn read(path: &Path) -> Result<Self> {
        let file: Self = read::json(path, "expected the edits.json of a labelgs viewer")?;
        read::require_version(path, file.schema_version, SCHEMA_VERSION)?;
        Ok(file)
    }

    /// Writes the file atomically.
    ///
    /// # Errors
    ///
    /// A file that cannot be written.
    pub fn write(&self, path: &Path) -> Result<()> {
        atomic::write_json(path, self)
    }

    /// Applies the edits in order. `path` names the file in messages; `sights` is as in [`Document::apply`].
    ///
    /// # Errors
    ///
    /// A model other than the original; an edit that fails, with its number.
    pub fn replay(&self, path: &Path, first: Document, sights: &mut Sights) -> Result<Document> {
        if (first.model.len() as u64, checksum(&first.model)) != (self.gaussians, self.checksum) {
            let problem = format!(
                "is for another model, with {}; replay it on the model that was opened first",
                counted(self.gaussians, "Gaussian")
            );
            return Err(Error::data(path, "", problem));
        }
        let mut document = first;
        for (edit, number) in self.edits.iter().zip(1..) {
            let failed = |error: Error| match error {
                Error::Usage { argument, problem } => {
                    Error::data(path, format!("edit {number}"), format!("{argument}: {problem}"))
                }
                other => other,
            };
            document = document.apply(edit, sights).map_err(failed)?;
        }
        Ok(document)
    }
}

fn checksum(model: &Gaussians) -> u32 {
    let mut hasher = crc32fast::Hasher::new();
    model.origin.to_array().iter().for_each(|value| hasher.update(&value.to_le_bytes()));
    model.means.iter().flatten().for_each(|value| hasher.update(&value.to_le_bytes()));
    model.labels.iter().flatten().for_each(|label| hasher.update(&label.to_le_bytes()));
    hasher.finalize()
}
