//! `edits.json`: the changes of a model, to be made again.

use super::{Document, Edit, Sights};
use labelgs_files::{atomic, read};
use labelgs_scene::words::counted;
use labelgs_scene::{Error, Gaussians, Result};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Version of the layout.
const SCHEMA_VERSION: u32 = 1;

/// The changes of a model, from the first to the last.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EditsFile {
    /// Version of the layout.
    pub schema_version: u32,
    /// Number of Gaussians of the first model.
    pub gaussians: u64,
    /// CRC-32 of their places and labels.
    pub checksum: u32,
    /// The changes.
    pub edits: Vec<Edit>,
}

impl EditsFile {
    /// Makes a list of changes of a model.
    pub fn new(first: &Gaussians, edits: Vec<Edit>) -> Self {
        Self { schema_version: SCHEMA_VERSION, gaussians: first.len() as u64, checksum: checksum(first), edits }
    }

    /// Reads a list.
    ///
    /// # Errors
    ///
    /// A file that is none, or of another version.
    pub fn read(path: &Path) -> Result<Self> {
        let file: Self = read::json(path, "expected the edits.json of a viewer of labelgs")?;
        read::require_version(path, file.schema_version, SCHEMA_VERSION)?;
        Ok(file)
    }

    /// Writes the list, atomically.
    ///
    /// # Errors
    ///
    /// A file that cannot be written.
    pub fn write(&self, path: &Path) -> Result<()> {
        atomic::write_json(path, self)
    }

    /// Makes the changes. `path` is the file of the list, for messages; `sights` as in [`Document::apply`].
    ///
    /// # Errors
    ///
    /// Another model than that of the list; a change that cannot be made, with its number.
    pub fn replay(&self, path: &Path, first: Document, sights: &mut Sights) -> Result<Document> {
        if (first.model.len() as u64, checksum(&first.model)) != (self.gaussians, self.checksum) {
            let problem = format!(
                "is for another model, of {}; replay it on the model that was opened first",
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
