//! Ground-truth masks of single objects from benchmarks: a black and white image per object and frame.

use super::resample::resample_ids;
use super::window::Window;
use labelgs_files::image::read_grey;
use labelgs_files::names::below;
use labelgs_files::resize::{aspect_problem, bounded_size};
use labelgs_scene::{Error, LabelMap, Result, View};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A ground-truth mask at the size of the comparison, row-major.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TruthMask {
    /// Width, px.
    pub width: u32,
    /// Height, px.
    pub height: u32,
    /// True for pixels of the object, `[height, width]`.
    pub inside: Vec<bool>,
}

/// Extensions of masks.
const MASK_EXTENSIONS: [&str; 3] = ["png", "jpg", "jpeg"];

/// Lists the PNG and JPEG files below a folder by relative path, sorted. Skips hidden files.
pub fn files_below(folder: &Path) -> Result<Vec<PathBuf>> {
    if !folder.is_dir() {
        return Err(Error::data(folder, "", "there is no such folder of true masks"));
    }
    let is_picture = |path: &PathBuf| {
        path.extension().is_some_and(|found| MASK_EXTENSIONS.iter().any(|known| found.eq_ignore_ascii_case(known)))
    };
    let mut found: Vec<PathBuf> = below(folder)?.into_iter().map(PathBuf::from).filter(is_picture).collect();
    found.sort();
    Ok(found)
}

/// Reads the mask of an object in `view`. A pixel belongs to the object if its value is above 128, or above 0 in a file
/// without values above 1.
///
/// The mask belongs to the original photo, and `windows` maps the view to the photo. The comparison uses the mask's own
/// size, undistorted, or the view's size if the mask is larger (nearest).
pub fn read_truth(path: &Path, view: &View, windows: &BTreeMap<String, Window>) -> Result<TruthMask> {
    let (width, height, values) = read_grey(path)?;
    let stored;
    let window = match windows.get(&view.name) {
        Some(window) => window,
        None => {
            stored = Window::stored(&view.name, &view.camera);
            &stored
        }
    };
    let photo = format!("photo {}", window.photo);
    if let Some(problem) = aspect_problem(("the mask", (width, height)), (&photo, window.optics.camera.size())) {
        return Err(Error::data(path, "", problem + "; use masks of the same photos"));
    }
    let above = if values.iter().all(|&value| value <= 1) { 0 } else { 128 };
    let ids = values.iter().map(|&value| u16::from(value > above)).collect();
    let own = match window.is_photo() {
        true => (width, height),
        false => bounded_size(window.camera.size(), Some(width.max(height))),
    };
    let pixels = |(width, height): (u32, u32)| u64::from(width) * u64::from(height);
    let size = if pixels(own) > pixels(view.camera.size()) { view.camera.size() } else { own };
    let map = resample_ids(&LabelMap { width, height, ids }, window, size);
    Ok(TruthMask { width: map.width, height: map.height, inside: map.ids.iter().map(|&id| id != 0).collect() })
}
