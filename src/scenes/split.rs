//! The split that a data set brings: which photos are held out, and which are trained on.

use super::listed_path::Place;
use super::listing::{Listed, Listing};
use labelgs_files::names::shortened;
use labelgs_files::read;
use labelgs_scene::words::counted;
use labelgs_scene::{Result, Setting};
use serde::Deserialize;
use std::collections::HashSet;
use std::path::{Path, PathBuf};

/// Names of photos, one a line, in the folder of the scene or of its model: 3DGS has the first, nerfstudio the next two.
const HELD_OUT: [&str; 3] = ["test.txt", "test_list.txt", "validation_list.txt"];
const TRAINED_ON: [&str; 2] = ["train.txt", "train_list.txt"];
/// Both lists, as ScanNet++ has them.
const BOTH: &str = "train_test_lists.json";

/// Lists of names of photos.
#[derive(Debug, Default)]
pub(super) struct Split {
    /// Where they come from, for messages.
    pub(super) source: String,
    /// Photos to train on; `None` means all that are not held out.
    pub(super) train: Option<Vec<String>>,
    pub(super) test: Vec<String>,
}

#[derive(Deserialize)]
struct Both {
    train: Vec<String>,
    test: Vec<String>,
}

impl Split {
    /// Reads the lists beside a scene; `None` without any.
    pub(super) fn find(scene: &Place, source: &Path) -> Result<Option<Self>> {
        let folders = [source.parent().unwrap_or(scene.root), scene.root];
        let file = |name: &&str| folders.iter().map(|folder| folder.join(name)).find(|path| path.is_file());
        if let Some(path) = file(&BOTH) {
            let Both { train, test } = read::json(&path, "expected {\"train\": [names], \"test\": [names]}")?;
            return Ok(Some(Self { source: path.display().to_string(), train: Some(train), test }));
        }
        let held_out: Vec<PathBuf> = HELD_OUT.iter().filter_map(file).collect();
        let Some(first) = held_out.first() else { return Ok(None) };
        let test = held_out.iter().map(|path| lines(path)).collect::<Result<Vec<_>>>()?.concat();
        let train = TRAINED_ON.iter().find_map(file).map(|path| lines(&path)).transpose()?;
        Ok(Some(Self { source: first.display().to_string(), train, test }))
    }

    /// Marks the views, and leaves out those that are in neither list where both are given. Lists that name none of the
    /// views are of something else.
    pub(super) fn apply(&self, listing: &mut Listing) {
        let Self { source, train, test } = self;
        let test = Names::new(test);
        let train = train.as_ref().map(|train| Names::new(train));
        let held_out = listing.views.iter().filter(|view| test.has(view)).count();
        if held_out == 0 {
            let known = train.as_ref().is_some_and(|train| listing.views.iter().any(|view| train.has(view)));
            if test.count > 0 || known {
                listing.notes.push(format!("{source} names no photo to hold out, so it is not used"));
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
            let (kept, left): (Vec<Listed>, Vec<Listed>) =
                std::mem::take(&mut listing.views).into_iter().partition(|view| test.has(view) || train.has(view));
            if !left.is_empty() {
                let names: Vec<&str> = left.iter().map(|view| view.name.as_str()).collect();
                note += &format!("; {} in no list are left out: {}", counted(left.len(), "photo"), shortened(&names));
            }
            listing.views = kept;
        }
        listing.notes.push(note);
    }
}

/// Names of a list, with and without folders and extensions.
struct Names {
    whole: HashSet<String>,
    /// Without folders, if no two of the names share one.
    last: HashSet<String>,
    count: usize,
}

impl Names {
    fn new(listed: &[String]) -> Self {
        let whole: HashSet<String> = listed.iter().map(|name| key(name)).collect();
        let last: HashSet<String> = whole.iter().map(|name| last(name).to_owned()).collect();
        let count = whole.len();
        Self { last: if last.len() == count { last } else { HashSet::new() }, whole, count }
    }

    fn has(&self, view: &Listed) -> bool {
        let name = key(&view.name);
        self.whole.contains(&name) || (!name.contains('/') && self.last.contains(&name))
    }
}

/// Returns a name without its extension and the folder of photos.
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
