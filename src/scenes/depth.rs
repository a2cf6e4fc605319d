//! Depth maps of the photos of a scene, from a folder.
//!
//! A map belongs to the photo file. It is undistorted and resized in the same way as the mask of the photo.

use super::lookup::Lookup;
use super::resample::resample_nearest;
use super::window::{Window, windows};
use labelgs_files::depth_file::{EXTENSIONS, read_depth};
use labelgs_files::names::shortened;
use labelgs_files::resize::same_aspect;
use labelgs_scene::{DepthMap, Error, Result, View};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::{Path, PathBuf};

/// A folder of depth maps, with what matches them to the views of a scene.
pub struct DepthFolder {
    folder: PathBuf,
    windows: BTreeMap<String, Window>,
    /// Number of photos per file stem. A map outside of the photo's folder serves only unique stems.
    stems: HashMap<PathBuf, usize>,
}

fn stem(name: &str) -> PathBuf {
    Path::new(name).file_stem().map(PathBuf::from).unwrap_or_default()
}

impl DepthFolder {
    /// Opens the maps in `folder` for the photos of `scene`. The scene must have been opened before.
    pub fn open(folder: &Path, scene: &Path, lookup: &Lookup) -> Result<Self> {
        if !folder.is_dir() {
            return Err(Error::data(folder, "", "there is no such folder of depth maps"));
        }
        let windows = windows(scene, lookup)?;
        let photos: BTreeSet<&str> = windows.values().map(|window| window.photo.as_str()).collect();
        let mut stems = HashMap::new();
        photos.into_iter().for_each(|name| *stems.entry(stem(name)).or_insert(0) += 1);
        Ok(Self { folder: folder.to_owned(), windows, stems })
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
            EXTENSIONS.join(", .")
        );
        Err(Error::data(&self.folder, "", problem))
    }

    /// Reads the map of `view`, at its size. Pixels outside of the photo are holes.
    pub fn read(&self, view: &View) -> Result<DepthMap> {
        let (Some(window), Some(path)) = (self.windows.get(&view.name), self.find(&view.name)) else {
            return Err(Error::data(&self.folder, &view.name, "has no depth map"));
        };
        let map = read_depth(&path)?;
        let photo = &window.optics.camera;
        if !same_aspect((map.width, map.height), (photo.width, photo.height)) {
            let problem = format!(
                "the depth map has {} x {} px and its photo {} x {} px, which no scale explains; make maps of the same \
                 photos",
                map.width, map.height, photo.width, photo.height
            );
            return Err(Error::data(&path, "", problem));
        }
        let (width, height) = (view.camera.width, view.camera.height);
        let from = (map.width, map.height);
        let values = resample_nearest(&map.values, from, window, (width, height), f32::NAN);
        if !values.iter().any(|value| value.is_finite()) {
            return Err(Error::data(&path, "", "holds no finite depth"));
        }
        Ok(DepthMap { width, height, values })
    }

    /// Finds the file of a view's photo: its name with the extension replaced or appended, then the same without folders.
    fn find(&self, view: &str) -> Option<PathBuf> {
        let name = self.windows.get(view)?.photo.as_str();
        let stem = stem(name);
        let flat = (self.stems.get(&stem) == Some(&1)).then_some(stem);
        let file = flat.is_some().then(|| Path::new(name).file_name().map(PathBuf::from)).flatten();
        let whole = [Some(Path::new(name).with_extension("")), Some(PathBuf::from(name)), flat, file];
        let candidates = whole.into_iter().flatten().flat_map(|base| {
            EXTENSIONS.map(|extension| {
                let mut path = self.folder.join(&base).into_os_string();
                path.push(".");
                path.push(extension);
                PathBuf::from(path)
            })
        });
        candidates.into_iter().find(|path| path.is_file())
    }
}
