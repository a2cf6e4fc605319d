//! Paths of photos and points as a scene lists them.
//!
//! A scene comes from anywhere, and what it lists is opened and, as the name of a view, written to. A path that leaves
//! the folder of the scene is refused by name, unless the user says that it is meant.

use crate::error::{Error, Result};
use std::path::{Component, Path, PathBuf};

/// The folder of a scene, and whether its files may lie elsewhere.
pub(crate) struct Place<'a> {
    /// The folder.
    pub(crate) root: &'a Path,
    /// Whether paths may leave it.
    allow_outside: bool,
}

/// A file that a scene lists.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct ListedPath {
    /// Path below the folder of the scene; absolute or with `..` only where that was allowed.
    pub(crate) path: PathBuf,
    /// The same as a name: separated by `/`, never absolute and without `..`, so that it is safe below any folder.
    pub(crate) name: String,
}

impl<'a> Place<'a> {
    pub(crate) fn new(root: &'a Path, allow_outside: bool) -> Self {
        Self { root, allow_outside }
    }

    /// What `listed` in the file `source` means. Backslashes, which programs on Windows write, separate folders too.
    pub(crate) fn resolve(&self, source: &Path, listed: &str) -> Result<ListedPath> {
        let refuse = |problem: &str| Err(Error::data(source, format!("photo `{}`", listed.escape_debug()), problem));
        let text = listed.replace('\\', "/");
        let mut path = PathBuf::from(&text);
        if let Ok(inside) = path.strip_prefix(self.root) {
            path = inside.to_owned();
        }
        let name = name_of(&path);
        if name.is_empty() || text.contains('\0') {
            return refuse("is no path of a file; list photos by paths relative to the scene folder");
        }
        let inside = path.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
        if !self.allow_outside && (!inside || has_drive(&text)) {
            return refuse(
                "lies outside the scene folder; list photos by paths relative to it, without `..`, or set \
                 `allow_outside` if the scene may read them there",
            );
        }
        Ok(ListedPath { path: if inside { PathBuf::from(&name) } else { path }, name })
    }
}

/// The path without its root and with `..` carried out, as far as there is anything to go back from.
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

/// True for `C:/photo.png`, which is absolute where it was written, if not here.
fn has_drive(text: &str) -> bool {
    matches!(text.as_bytes(), [letter, b':', b'/', ..] if letter.is_ascii_alphabetic())
}
