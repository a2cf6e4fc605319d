//! Where the photos of a scene are, and how its poses are meant, if the scene itself is silent or wrong.

use super::pose_convention::PoseConvention;
use std::path::{Path, PathBuf};

/// How a scene is looked up. The default trusts the scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Lookup {
    /// Accepts files outside the scene's folder, by absolute paths or `..`.
    pub allow_outside: bool,
    /// Folder of the photos instead of the listed one: an existing path, or one below the scene. `None` uses the listed
    /// paths, and for a missing photo also the usual photo folders.
    pub images: Option<PathBuf>,
    /// The pose convention of the scene's file.
    pub poses: PoseConvention,
}

impl Lookup {
    /// Returns the named photo folder, if any.
    pub fn images_of(&self, root: &Path) -> Option<PathBuf> {
        let named = self.images.as_deref()?;
        let below = root.join(named);
        Some(if !named.is_dir() && below.is_dir() { below } else { named.to_owned() })
    }
}
