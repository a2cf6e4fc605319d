//! LLFF's and NeRF's `poses_bounds.npy`: a row of 17 numbers per photo, in the order of the photos' names.
//!
//! A row is a 3 x 5 matrix, row-major, then the nearest and the farthest depth, which are ignored. The columns of the
//! matrix are the axes of the camera in the world (down, right, backwards), its centre, and height, width and focal
//! length, px (Mildenhall et al., *Local light field fusion*, `imgs2poses.py`).

use super::lens::Lens;
use super::listed_path::SceneFolder;
use super::listing::{ListedPhoto, Listing, check_camera, invert_pose, require_some, rotation_of, side};
use super::photo_finder::is_readable;
use super::pose_convention::Native;
use glam::{DMat3, DVec3};
use labelgs_files::{npy, read};
use labelgs_scene::{Camera, Error, Result};
use std::path::{Path, PathBuf};

/// Name of the file.
const POSES_FILE: &str = "poses_bounds.npy";
/// Numbers in a row.
const ROW_NUMBERS: usize = 17;

/// Reads the scene, if it has the file.
pub fn list(scene: &SceneFolder) -> Result<Option<Listing>> {
    let path = scene.root.join(POSES_FILE);
    if path.is_file() { list_file(scene, &path).map(Some) } else { Ok(None) }
}

/// Returns the number of photos with poses in a file; `None` if the file cannot be read.
pub fn count(path: &Path) -> Option<usize> {
    npy::read::<2>(path, "table of poses", "(photos, 17)").ok().map(|([rows, _], _)| rows)
}

pub fn list_file(scene: &SceneFolder, path: &Path) -> Result<Listing> {
    let ([rows, columns], values) = npy::read::<2>(path, "table of poses", "(photos, 17)")?;
    if columns != ROW_NUMBERS {
        let problem = format!("is ({rows}, {columns}); expected (photos, {ROW_NUMBERS}): 3 x 5 numbers and two depths");
        return Err(Error::data(path, "shape", problem));
    }
    let photos = photos(&scene.photos.folder("images"))?;
    if photos.len() != rows {
        let problem = format!(
            "has poses of {rows} photos, but {} holds {} PNG or JPEG files; each of them needs a row, in the \
             order of their names",
            scene.photos.folder("images").display(),
            photos.len()
        );
        return Err(Error::data(path, "", problem));
    }
    let mut listing = Listing::new(path, Native::CAMERA_TO_WORLD);
    for (index, (photo, row)) in photos.into_iter().zip(values.chunks_exact(ROW_NUMBERS)).enumerate() {
        let name = photo.file_name().unwrap_or_default().to_string_lossy().into_owned();
        match camera(path, &format!("row {index} (`{name}`)"), row) {
            Ok(camera) => {
                listing.views.push(ListedPhoto { name, photo: Some(photo), camera, lens: Lens::Pinhole, test: None });
            }
            Err(error) => listing.bad.push(error),
        }
    }
    require_some(listing.views.len(), &mut listing.bad)?;
    Ok(listing)
}

/// Lists the photos in a folder, sorted by name.
fn photos(folder: &Path) -> Result<Vec<PathBuf>> {
    if !folder.is_dir() {
        return Err(Error::data(
            folder,
            "",
            format!("there is no such folder; {POSES_FILE} belongs to the photos in it"),
        ));
    }
    let is_photo = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        is_readable(path) && !name.starts_with('.') && path.is_file()
    };
    let mut photos: Vec<PathBuf> = read::folder(folder)?.into_iter().filter(is_photo).collect();
    photos.sort();
    Ok(photos)
}

fn camera(path: &Path, place: &str, row: &[f64]) -> Result<Camera> {
    let column = |index: usize| DVec3::new(row[index], row[5 + index], row[10 + index]);
    let (down, right, backwards, centre, size) = (column(0), column(1), column(2), column(3), column(4));
    let rotation = rotation_of(DMat3::from_cols(right, down, -backwards)).ok_or_else(|| {
        Error::data(path, place, "the first three columns are not camera axes; expected down, right and backwards")
    })?;
    let (rotation, translation) = invert_pose(rotation, centre);
    let (height, width) = (side(path, place, size.x)?, side(path, place, size.y)?);
    let (cx, cy) = (size.y / 2.0, size.x / 2.0);
    let camera = Camera { rotation, translation, fx: size.z, fy: size.z, cx, cy, width, height };
    check_camera(path, place, &camera, &Lens::Pinhole)?;
    Ok(camera)
}
