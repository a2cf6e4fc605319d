//! DEVA's `pred.json`: the ids of a run and their categories.

use super::shortened;
use labelgs_files::read;
use labelgs_scene::{Error, Result, Setting};
use serde::Deserialize;
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

#[derive(Deserialize)]
struct File {
    annotations: Vec<Annotation>,
    #[serde(default)]
    categories: Vec<Category>,
}

#[derive(Deserialize)]
struct Annotation {
    segments_info: Vec<Segment>,
}

#[derive(Deserialize)]
struct Segment {
    id: u32,
    #[serde(default)]
    category_id: Value,
}

#[derive(Deserialize)]
struct Category {
    id: Value,
    name: String,
}

/// The ids of a DEVA run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Pred {
    pub(super) path: PathBuf,
    /// Names of the categories by id, where known.
    pub(super) ids: BTreeMap<u32, Option<String>>,
}

impl Pred {
    /// Reads the file. Names come from `categories`; other categories are named `category N`.
    pub(super) fn read(path: &Path) -> Result<Self> {
        let expected = r#"expected {"annotations": [{"segments_info": [{"id": 1, "category_id": null}]}]}"#;
        let file: File = read::json(path, expected)?;
        let name = |category: &Value| match category {
            Value::Null => None,
            category => {
                let listed = file.categories.iter().find(|listed| listed.id == *category);
                Some(match (listed, category) {
                    (Some(listed), _) => listed.name.clone(),
                    (None, Value::String(text)) => text.clone(),
                    (None, other) => format!("category {other}"),
                })
            }
        };
        let mut ids: BTreeMap<u32, Option<String>> = BTreeMap::new();
        for segment in file.annotations.iter().flat_map(|annotation| &annotation.segments_info) {
            if segment.id == 0 {
                return Err(Error::data(path, "segments_info", "has the id 0, which is the background"));
            }
            let known = ids.entry(segment.id).or_default();
            *known = known.take().or_else(|| name(&segment.category_id));
        }
        Ok(Self { path: path.to_owned(), ids })
    }

    /// Returns the path of the file for a mask folder: inside it, or beside it if the folder is called `Annotations`.
    pub(super) fn find(root: &Path) -> Option<PathBuf> {
        let beside = root.file_name().filter(|name| *name == "Annotations").and(root.parent());
        [Some(root), beside].into_iter().flatten().map(|folder| folder.join("pred.json")).find(|path| path.is_file())
    }

    /// Refuses images with ids that the run does not list.
    pub(super) fn check(&self, root: &Path, found: &BTreeSet<u32>) -> Result<()> {
        let unknown: Vec<String> =
            found.iter().filter(|id| !self.ids.contains_key(id)).map(ToString::to_string).collect();
        if unknown.is_empty() {
            return Ok(());
        }
        let problem = format!(
            "{} of {} ids in the images are not in {} (such as {}): the images are display colours or from another \
             run; name the right file in {}, or move the wrong one away and set {}",
            unknown.len(),
            found.len(),
            self.path.display(),
            shortened(&unknown),
            Setting("pred"),
            Setting("format")
        );
        Err(Error::data(root, "", problem))
    }
}
