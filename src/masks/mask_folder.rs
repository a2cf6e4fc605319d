//! A mask folder: finds the file of each photo.

use labelgs_files::names::{below, shortened};
use labelgs_files::photo_files::{PhotoFiles, key_of};
use labelgs_scene::{Error, Result};
use std::path::Path;

/// Extension of masks.
const MASK_EXTENSION: &str = "png";

/// Returns `name` without `.png` (any case), or `None` for other files.
pub fn png_key(name: &str) -> Option<&str> {
    key_of(name, MASK_EXTENSION)
}

/// Finds the masks of photos in a folder; `names` lists all photos of the scene.
pub fn masks_of_photos(folder: &Path, names: &[&str]) -> Result<PhotoFiles> {
    if folder.is_file() {
        let problem = "is a file, expected a folder of id masks; masks in one file, such as COCO's, become one by \
                       `masks import` with the scene";
        return Err(Error::data(folder, "", problem));
    }
    if !folder.is_dir() {
        return Err(Error::data(folder, "", "there is no such folder"));
    }
    PhotoFiles::new(folder, names, &[MASK_EXTENSION])
}

/// Creates the error for a folder without masks for any photo, such as the photo `name`.
pub(super) fn no_mask_found(folder: &Path, name: &str) -> Error {
    let expected = Path::new(name).with_extension(MASK_EXTENSION);
    let mut text = format!("has no PNG for any photo of the scene; expected for example {}", expected.display());
    if ["jpg", "jpeg", "JPG"].iter().any(|ext| folder.join(expected.with_extension(ext)).is_file()) {
        text.push_str("; JPEG is refused because its compression changes ids; write PNG");
    } else if let Ok(files) = below(folder) {
        let there = if files.is_empty() { "nothing".to_owned() } else { shortened(&files) };
        text.push_str(&format!("; it holds {there}"));
    }
    Error::data(folder, "", text)
}
