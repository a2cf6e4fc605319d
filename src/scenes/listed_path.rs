//! Paths of photos and points as listed in a scene.
//!
//! A scene is untrusted input. Its paths are opened for reading, and used for writing as the names of views. A path
//! outside the scene's folder is refused unless the user allows it.

use super::lookup::Lookup;
use super::photo_finder::PhotoFinder;
use labelgs_scene::{Error, Result, Setting};
use std::path::{Component, Path, PathBuf};

/// The folder of a scene, and how its files are found.
pub struct SceneFolder<'a> {
    pub root: &'a Path,
    lookup: &'a Lookup,
    pub photos: PhotoFinder,
}

/// A file listed in a scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ListedPath {
    /// Path below the scene's folder. It is absolute or contains `..` only if that is allowed.
    pub path: PathBuf,
    /// The path as a name: separated by `/`, relative and without `..`, so that it is safe below any folder.
    pub name: String,
}

impl<'a> SceneFolder<'a> {
    pub fn new(root: &'a Path, lookup: &'a Lookup) -> Self {
        Self { root, lookup, photos: PhotoFinder::new(root, lookup.images_of(root)) }
    }

    /// Resolves the path `listed` in the file `source`. Backslashes also separate folders, as in files from Windows.
    pub fn resolve(&self, source: &Path, listed: &str) -> Result<ListedPath> {
        let refuse = |problem: &str| Err(Error::data(source, format!("photo `{}`", listed.escape_debug()), problem));
        let text = listed.replace('\\', "/");
        let mut path = PathBuf::from(&text);
        if let Ok(inside) = path.strip_prefix(self.root) {
            path = inside.to_owned();
        }
        let name = name_of(&path);
        if name.is_empty() || text.contains('\0') {
            return refuse("is not a file path; list photos by paths relative to the scene folder");
        }
        let inside = path.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
        if !self.lookup.allow_outside && (!inside || has_drive(&text)) {
            return refuse(&format!(
                "lies outside the scene folder; list photos by paths relative to it, without `..`, or set {} if the scene \
                 may read them there",
                Setting("allow_outside")
            ));
        }
        Ok(ListedPath { path: if inside { PathBuf::from(&name) } else { path }, name })
    }
}

/// Returns the path without its root and with `..` resolved as far as possible.
fn name_of(path: &Path) -> String {
    let mut parts: Vec<&str> = Vec::new();
    for part in path.components() {
        match part {
            Component::Normal(part) => parts.extend(part.to_str()),
            Component::ParentDir => drop(parts.pop()),
            _ => {}
        }
    }
    parts.join("/")
}

/// Returns true for paths such as `C:/photo.png`, which are absolute only on Windows.
fn has_drive(text: &str) -> bool {
    matches!(text.as_bytes(), [letter, b':', b'/', ..] if letter.is_ascii_alphabetic())
}
