//! The split of a data set: which photos are held out, and which are for training.

use super::listed_path::SceneFolder;
use super::listing::{ListedPhoto, Listing};
use labelgs_files::names::shortened;
use labelgs_files::read;
use labelgs_scene::words::counted;
use labelgs_scene::{Result, Setting};
use serde::Deserialize;
use std::collections::HashSet;
use std::path::{Path, PathBuf};

/// Lists of photo names, one per line, in the folder of the scene or of its model: 3DGS has the first, nerfstudio the
/// next two.
const HELD_OUT_LISTS: [&str; 3] = ["test.txt", "test_list.txt", "validation_list.txt"];
const TRAINING_LISTS: [&str; 2] = ["train.txt", "train_list.txt"];
/// Both lists in one file, as in ScanNet++.
const BOTH_LISTS: &str = "train_test_lists.json";

/// Lists of photo names.
#[derive(Debug, Default)]
pub(super) struct SceneSplit {
    /// Source of the lists, for messages.
    pub(super) source: String,
    /// Photos for training; `None` means all that are not held out.
    pub(super) train: Option<Vec<String>>,
    pub(super) test: Vec<String>,
}

#[derive(Deserialize)]
struct BothLists {
    train: Vec<String>,
    test: Vec<String>,
}

impl SceneSplit {
    /// Reads the lists beside a scene; `None` without any.
    pub(super) fn find(scene: &SceneFolder, source: &Path) -> Result<Option<Self>> {
        let folders = [source.parent().unwrap_or(scene.root), scene.root];
        let file = |name: &&str| folders.iter().map(|folder| folder.join(name)).find(|path| path.is_file());
        if let Some(path) = file(&BOTH_LISTS) {
            let BothLists { train, test } = read::json(&path, "expected {\"train\": [names], \"test\": [names]}")?;
            return Ok(Some(Self { source: path.display().to_string(), train: Some(train), test }));
        }
        let held_out: Vec<PathBuf> = HELD_OUT_LISTS.iter().filter_map(file).collect();
        let Some(first) = held_out.first() else { return Ok(None) };
        let test = held_out.iter().map(|path| lines(path)).collect::<Result<Vec<_>>>()?.concat();
        let train = TRAINING_LISTS.iter().find_map(file).map(|path| lines(&path)).transpose()?;
        Ok(Some(Self { source: first.display().to_string(), train, test }))
    }

    /// Marks the views, and omits views in neither list if both are given. Ignores lists that name none of the views,
    /// because they belong to something else.
    pub(super) fn apply(&self, listing: &mut Listing) {
        let Self { source, train, test } = self;
        let test = NameSet::new(test);
        let train = train.as_ref().map(|train| NameSet::new(train));
        let held_out = listing.views.iter().filter(|view| test.has(view)).count();
        if held_out == 0 {
            let known = train.as_ref().is_some_and(|train| listing.views.iter().any(|view| train.has(view)));
            if test.count > 0 || known {
                listing.notes.push(format!("{source} names no photo to hold out, so it is ignored"));
            }
            return;
        }
        listing.views.iter_mut().for_each(|view| view.test = Some(test.has(view)));
        let mut note = format!(
            "{} held out as {source} says; {} holds out none",
            counted(held_out, "photo"),
            Setting("test_every").to(0)
        );
        if held_out < test.count {
            note += &format!("; {} more in the list are not in the scene", test.count - held_out);
        }
        if let Some(train) = train {
            let (kept, left): (Vec<ListedPhoto>, Vec<ListedPhoto>) =
                std::mem::take(&mut listing.views).into_iter().partition(|view| test.has(view) || train.has(view));
            if !left.is_empty() {
                let names: Vec<&str> = left.iter().map(|view| view.name.as_str()).collect();
                note += &format!("; {} in no list are omitted: {}", counted(left.len(), "photo"), shortened(&names));
            }
            listing.views = kept;
        }
        listing.notes.push(note);
    }
}

/// Names in a list, with and without folders and extensions.
struct NameSet {
    whole: HashSet<String>,
    /// Names without folders, unless two of them are equal.
    last: HashSet<String>,
    count: usize,
}

impl NameSet {
    fn new(listed: &[String]) -> Self {
        let whole: HashSet<String> = listed.iter().map(|name| key(name)).collect();
        let last: HashSet<String> = whole.iter().map(|name| last(name).to_owned()).collect();
        let count = whole.len();
        Self { last: if last.len() == count { last } else { HashSet::new() }, whole, count }
    }

    fn has(&self, view: &ListedPhoto) -> bool {
        let name = key(&view.name);
        self.whole.contains(&name) || (!name.contains('/') && self.last.contains(&name))
    }
}

/// Returns a name without its extension and without the photo folder.
fn key(name: &str) -> String {
    let name = name.trim().replace('\\', "/");
    let name = name.trim_start_matches("./").trim_start_matches("images/");
    let stem = match last(name).rfind('.') {
        Some(at) if at > 0 => &name[..name.len() - last(name).len() + at],
        _ => name,
    };
    stem.to_owned()
}

fn last(name: &str) -> &str {
    name.rsplit('/').next().unwrap_or(name)
}

fn lines(path: &Path) -> Result<Vec<String>> {
    let text = read::text(path)?;
    let names = text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'));
    Ok(names.map(str::to_owned).collect())
}
