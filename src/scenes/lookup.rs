//! Where the photos of a scene are, and how its poses are meant, where the scene itself is silent or wrong.

use super::pose_convention::PoseConvention;
use std::path::{Path, PathBuf};

/// How a scene is looked up. The default trusts the scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Lookup {
    /// Accepts files outside of the scene's folder, by absolute paths or `..`.
    pub allow_outside: bool,
    /// Folder of the photos in place of the listed one: a path as it is, or below the scene. `None` takes the listed
    /// paths, and for a photo that is not there the folders in which programs put photos.
    pub images: Option<PathBuf>,
    /// What the scene's file means by its poses.
    pub poses: PoseConvention,
}

impl Lookup {
    /// Returns the folder of photos, if one is named.
    pub fn images_of(&self, root: &Path) -> Option<PathBuf> {
        let named = self.images.as_deref()?;
        let below = root.join(named);
        Some(if !named.is_dir() && below.is_dir() { below } else { named.to_owned() })
    }
}
