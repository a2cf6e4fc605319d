//! `occlusion.json`: the occluders of each object in each view.

use crate::error::{Error, Result};
use crate::files::{atomic, read};
use crate::scene::labels::Occluders;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// Name of the file in the folder of a run.
pub(crate) const OCCLUSION_FILE: &str = "occlusion.json";
const SCHEMA_VERSION: u32 = 1;

/// A table of occluders.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct OcclusionTable {
    /// Version of the layout.
    pub schema_version: u32,
    /// Source of the lists: `none`, `depth` or `rendered`.
    pub kind: String,
    /// For each view (by name) and object: the objects that hide a part of it, 0 for unlabelled areas.
    pub views: BTreeMap<String, Occluders>,
}

impl OcclusionTable {
    /// Makes a table of these lists.
    pub fn new(kind: &str, views: BTreeMap<String, Occluders>) -> Self {
        Self { schema_version: SCHEMA_VERSION, kind: kind.to_owned(), views }
    }

    /// Reads a table and sorts its lists. Other versions, 0 as an object, and objects that hide themselves are errors.
    pub fn read(path: &Path) -> Result<Self> {
        let expected = r#"expected {"schema_version": 1, "kind": "depth", "views": {"00.png": {"1": [], "2": [1]}}}"#;
        let mut table: Self = read::json(path, expected)?;
        if table.schema_version != SCHEMA_VERSION {
            let problem = format!("has version {}, labelgs reads {SCHEMA_VERSION}", table.schema_version);
            return Err(Error::data(path, "schema_version", problem));
        }
        for (name, objects) in &mut table.views {
            for (&label, hidden_by) in objects {
                let place = || format!("view {name}, object {label}");
                if label == 0 {
                    return Err(Error::data(path, place(), "0 is not an object; objects have ids from 1 to 65535"));
                }
                if hidden_by.contains(&label) {
                    return Err(Error::data(path, place(), "hides itself"));
                }
                hidden_by.sort_unstable();
                hidden_by.dedup();
            }
        }
        Ok(table)
    }

    /// Writes the table, atomically.
    pub fn write(&self, path: &Path) -> Result<()> {
        atomic::write_json(path, self)
    }

    /// Returns the number of (object, occluder) pairs over all views.
    pub fn pair_count(&self) -> usize {
        self.views.values().flat_map(Occluders::values).map(Vec::len).sum()
    }
}
