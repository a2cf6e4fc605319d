//! `labels.json`: names, colours and counts of the ids in a mask folder or a model.
//!
//! The file is in the mask folder or the run folder, or beside a single PLY as `NAME.labels.json`.

use super::{atomic, read, run_folder};
use labelgs_scene::labels::{LABEL_MAX, MODEL_LABEL_MAX, label_colour};
use labelgs_scene::words::unique;
use labelgs_scene::{Error, Result};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Name of the file in a folder.
pub const FILE_NAME: &str = "labels.json";
/// Version of the layout.
const SCHEMA_VERSION: u32 = 1;

fn schema_version() -> u32 {
    SCHEMA_VERSION
}

/// Returns `name`, with the first number appended that makes the name unique.
pub fn unique_name(name: String, taken: &mut BTreeSet<String>) -> String {
    unique(name, " ", taken)
}

/// One object. A file only needs the id; the default colour is that of [`LabelEntry::new`].
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "StoredEntry")]
pub struct LabelEntry {
    /// Id in masks, 1 to 65535, or in models, 1 to 2147483647.
    pub id: u32,
    /// Display name; unique.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Display colour, sRGB bytes.
    pub colour: [u8; 3],
    /// Id, colour or folder of the object in the source of the masks.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub source: Option<String>,
    /// Number of pixels over all masks; 0 without masks.
    pub pixels: u64,
    /// Number of masks that contain the object.
    pub views: u32,
    /// Unknown keys, which are preserved.
    #[serde(flatten)]
    pub others: BTreeMap<String, Value>,
}

/// An entry as stored in a file.
#[derive(Deserialize)]
struct StoredEntry {
    id: u32,
    #[serde(default)]
    name: Option<String>,
    #[serde(default, alias = "color")]
    colour: Option<[u8; 3]>,
    #[serde(default)]
    source: Option<String>,
    #[serde(default)]
    pixels: u64,
    #[serde(default)]
    views: u32,
    #[serde(flatten)]
    others: BTreeMap<String, Value>,
}

impl From<StoredEntry> for LabelEntry {
    fn from(listed: StoredEntry) -> Self {
        let StoredEntry { id, name, colour, source, pixels, views, others } = listed;
        let colour = colour.unwrap_or_else(|| label_colour(id));
        Self { id, name, colour, source, pixels, views, others }
    }
}

impl LabelEntry {
    /// Creates an entry with only an id.
    pub fn new(id: u32) -> Self {
        Self { id, name: None, colour: label_colour(id), source: None, pixels: 0, views: 0, others: BTreeMap::new() }
    }
}

/// A table of objects, sorted by id.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LabelTable {
    /// Version of the layout. A file without it has version 1.
    #[serde(default = "schema_version")]
    pub schema_version: u32,
    /// One entry per id.
    pub labels: Vec<LabelEntry>,
}

impl LabelTable {
    /// Creates a table of these entries, sorted by id.
    pub fn new(mut labels: Vec<LabelEntry>) -> Self {
        labels.sort_by_key(|entry| entry.id);
        Self { schema_version: SCHEMA_VERSION, labels }
    }

    /// Reads a table. Another version, an invalid id, and a repeated id or name are errors.
    pub fn read(path: &Path) -> Result<Self> {
        Self::parse(path, read::text(path)?.as_bytes())
    }

    /// Like [`Self::read`], from the bytes of the file `path`.
    pub fn parse(path: &Path, text: &[u8]) -> Result<Self> {
        let expected =
            r#"expected {"labels": [{"id": 1, "name": "cup"}]}, where "colour": [r, g, b] from 0 to 255 may be added"#;
        read::parse_json::<Self>(path, text, expected)?.checked(path)
    }

    /// Returns the table sorted if it obeys the rules of [`Self::read`]. `path` is its file, for messages.
    pub fn checked(&self, path: &Path) -> Result<Self> {
        read::require_version(path, self.schema_version, SCHEMA_VERSION)?;
        let (mut ids, mut names) = (BTreeSet::new(), BTreeSet::new());
        for entry in &self.labels {
            let place = format!("label {}", entry.id);
            if entry.id == 0 || entry.id > MODEL_LABEL_MAX {
                return Err(Error::data(path, place, format!("labels are from 1 to {MODEL_LABEL_MAX}")));
            }
            if !ids.insert(entry.id) {
                return Err(Error::data(path, place, "occurs twice; ids must be unique"));
            }
            if entry.name.as_ref().is_some_and(|name| !names.insert(name)) {
                return Err(Error::data(path, place, "has the name of another label; names must be unique"));
            }
        }
        Ok(Self::new(self.labels.clone()))
    }

    /// Reads the table of a mask folder, if there is one.
    pub fn read_in_folder(folder: &Path) -> Result<Option<Self>> {
        let path = folder.join(FILE_NAME);
        if !path.is_file() {
            return Ok(None);
        }
        let table = Self::read(&path)?;
        match table.labels.iter().find(|entry| entry.id > LABEL_MAX) {
            Some(entry) => {
                let problem = format!("labels of masks are from 1 to {LABEL_MAX}");
                Err(Error::data(&path, format!("label {}", entry.id), problem))
            }
            None => {
                table.warn_of_unknown_keys(&path);
                Ok(Some(table))
            }
        }
    }

    /// Warns about unknown keys, which may be misspelt.
    fn warn_of_unknown_keys(&self, path: &Path) {
        let keys: BTreeSet<&str> =
            self.labels.iter().flat_map(|entry| entry.others.keys()).map(String::as_str).collect();
        if !keys.is_empty() {
            let keys = keys.into_iter().collect::<Vec<_>>().join(", ");
            tracing::warn!("{}: ignores unknown keys, but keeps them: {keys}", path.display());
        }
    }

    /// Writes the table atomically.
    pub fn write(&self, path: &Path) -> Result<()> {
        atomic::write_json(path, self)
    }

    /// Returns the entry of an id.
    pub fn entry(&self, id: u32) -> Option<&LabelEntry> {
        self.labels.binary_search_by_key(&id, |entry| entry.id).ok().map(|at| &self.labels[at])
    }

    /// Returns the name of an id, if it has one.
    pub fn name(&self, id: u32) -> Option<&str> {
        self.entry(id)?.name.as_deref()
    }

    /// Returns the id with this name, ignoring case.
    pub fn id_of(&self, name: &str) -> Option<u32> {
        let found = |entry: &&LabelEntry| entry.name.as_ref().is_some_and(|own| own.eq_ignore_ascii_case(name));
        self.labels.iter().find(found).map(|entry| entry.id)
    }

    /// Returns the path of a model's table, if there is one: `NAME.labels.json` beside the PLY, or else `labels.json`
    /// in the run folder.
    pub fn find_for_model(model: &Path) -> Option<PathBuf> {
        let of_run = run_folder::find_for_model(model).map(|run| run.join(FILE_NAME));
        [Some(Self::path_beside(model)), of_run].into_iter().flatten().find(|path| path.is_file())
    }

    /// Writes the table to `path`. Without a table, removes the file, because its names would be wrong.
    pub fn write_or_remove(table: Option<&Self>, path: &Path) -> Result<()> {
        match table {
            Some(table) => table.write(path),
            None => atomic::remove(path),
        }
    }

    /// Returns the path of the table for a PLY outside a run folder.
    pub fn path_beside(model: &Path) -> PathBuf {
        model.with_extension(FILE_NAME)
    }
}
