//! Depth maps of a scene's photos, from a folder.
//!
//! A map belongs to the photo file. It is undistorted and resized like the mask of the photo.

use super::lookup::Lookup;
use super::resample::resample_nearest;
use super::window::{Window, windows};
use labelgs_files::depth_file::{DEPTH_EXTENSIONS, read_depth};
use labelgs_files::names::shortened;
use labelgs_files::photo_files::PhotoFiles;
use labelgs_files::resize::aspect_problem;
use labelgs_scene::{DepthMap, Error, Result, View};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// A folder of depth maps, and how they match the views of a scene.
pub struct DepthFolder {
    files: PhotoFiles,
    windows: BTreeMap<String, Window>,
}

impl DepthFolder {
    /// Opens the maps in `folder` for the photos of `scene`, which must have been opened before.
    pub fn open(folder: &Path, scene: &Path, lookup: &Lookup) -> Result<Self> {
        if !folder.is_dir() {
            return Err(Error::data(folder, "", "there is no such folder of depth maps"));
        }
        let windows = windows(scene, lookup)?;
        let photos: BTreeSet<&str> = windows.values().map(|window| window.photo.as_str()).collect();
        let files = PhotoFiles::new(folder, &photos.into_iter().collect::<Vec<_>>(), &DEPTH_EXTENSIONS)?;
        Ok(Self { files, windows })
    }

    /// Refuses a folder without a map for one of `views`.
    pub fn check_complete(&self, views: &[&View]) -> Result<()> {
        let without: Vec<&str> =
            views.iter().map(|view| view.name.as_str()).filter(|name| self.find(name).is_none()).collect();
        if without.is_empty() {
            return Ok(());
        }
        let problem = format!(
            "{} of {} photos that need a depth map have none: {}; expected files named like the photos, ending in .{}",
            without.len(),
            views.len(),
            shortened(&without),
            DEPTH_EXTENSIONS.join(", .")
        );
        Err(Error::data(&self.files.folder, "", problem))
    }

    /// Reads the map of `view` at its size. Pixels outside the photo are holes.
    pub fn read(&self, view: &View) -> Result<DepthMap> {
        let Some((window, path)) = self.find(&view.name) else {
            return Err(Error::data(&self.files.folder, &view.name, "has no depth map"));
        };
        let map = read_depth(path)?;
        let from = (map.width, map.height);
        if let Some(problem) = aspect_problem(("the depth map", from), ("its photo", window.optics.camera.size())) {
            return Err(Error::data(path, "", problem + "; make maps of the same photos"));
        }
        let (width, height) = view.camera.size();
        let values = part_of(window, view, |size| resample_nearest(&map.values, from, window, size, f32::NAN));
        if !values.iter().any(|value| value.is_finite()) {
            return Err(Error::data(path, "", "holds no finite depth"));
        }
        Ok(DepthMap { width, height, values })
    }

    /// Finds the window of a view in its photo, and the photo's map.
    fn find(&self, view: &str) -> Option<(&Window, &Path)> {
        let window = self.windows.get(view)?;
        Some((window, self.files.find(&window.photo)?))
    }
}

/// Crops values of the whole window to the view: views of isolated objects are crops.
fn part_of(window: &Window, view: &View, whole: impl FnOnce((u32, u32)) -> Vec<f32>) -> Vec<f32> {
    let (of, camera) = (&window.camera, &view.camera);
    let side = |side: u32, scale: f64| (f64::from(side) * scale).round() as u32;
    let size = (side(of.width, camera.fx / of.fx), side(of.height, camera.fy / of.fy));
    if size.0 <= camera.width && size.1 <= camera.height {
        return whole(camera.size());
    }
    let full = of.resized(size.0, size.1);
    let [left, top] = [full.cx - camera.cx, full.cy - camera.cy].map(|side| side.round().max(0.0) as usize);
    let rows = whole(size);
    let row = |y: usize| {
        let first = ((top + y).min(size.1 as usize - 1)) * size.0 as usize + left;
        rows[first.min(rows.len())..(first + camera.width as usize).min(rows.len())].iter().copied()
    };
    (0..camera.height as usize).flat_map(row).collect()
}
