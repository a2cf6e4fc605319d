//! COLMAP sparse models: `cameras`, `images` and `points3D`, binary or text.
//!
//! Poses are camera-from-world with OpenCV axes, and the centre of pixel (0, 0) is at (0.5, 0.5). Both conventions are
//! ours, so nothing is converted. The `rigs` and `frames` files of newer versions are not read.

mod binary;
mod model;
mod text;
pub(crate) mod write;

use super::listed_path::Place;
use super::listing::{FAR, Listed, Listing, check_camera};
use crate::error::{Error, Result};
use crate::scene::{Camera, Point};
use glam::{DMat3, DQuat, DVec2, DVec3};
use model::{CameraRecord, ImageRecord};
use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::{Path, PathBuf};

/// Folders below the scene that may hold the model, in order of preference.
const FOLDERS: [&str; 4] = ["sparse/0", "sparse", "colmap/sparse/0", "."];

struct Files {
    folder: PathBuf,
    extension: &'static str,
}

/// Finds a model below `root`. Binary wins over text.
fn find(root: &Path) -> Option<Files> {
    FOLDERS.iter().find_map(|folder| {
        let folder = root.join(folder);
        ["bin", "txt"].into_iter().find_map(|extension| {
            let both = ["cameras", "images"].iter().all(|stem| folder.join(stem).with_extension(extension).is_file());
            both.then(|| Files { folder: folder.clone(), extension })
        })
    })
}

/// Reads the model of the scene, if there is one.
pub(crate) fn list(scene: &Place) -> Result<Option<Listing>> {
    let Some(files) = find(scene.root) else { return Ok(None) };
    let path = |stem: &str| files.folder.join(stem).with_extension(files.extension);
    let binary = files.extension == "bin";
    let (cameras_path, images_path, points_path) = (path("cameras"), path("images"), path("points3D"));
    let cameras = if binary { binary::cameras(&cameras_path) } else { text::cameras(&cameras_path) }?;
    let images = if binary { binary::images(&images_path, false) } else { text::images(&images_path, false) }?;
    let mut notes = Vec::new();
    let points = match (points_path.is_file(), binary) {
        (false, _) => Vec::new(),
        (true, true) => binary::points(&points_path)?,
        (true, false) => text::points(&points_path)?,
    };
    let points = finite(points.into_iter().map(|(_, point)| point).collect(), &mut notes);
    if files.folder.ends_with("sparse/0") && files.folder.with_file_name("1").is_dir() {
        notes.push(format!("only the model {} is used; its neighbours are ignored", files.folder.display()));
    }
    let views = join(scene, &cameras_path, &cameras, &images_path, &images)?;
    Ok(Some(Listing { source: images_path, views, points, notes, ..Listing::default() }))
}

/// A point in a photo, and the same point in the world.
pub(crate) type Seen = (DVec2, DVec3);

/// Reads which points each photo of a COLMAP model shows, by name of the view; none without a model.
pub(crate) fn observations(scene: &Place) -> Result<Option<BTreeMap<String, (Listed, Vec<Seen>)>>> {
    let Some(files) = find(scene.root) else { return Ok(None) };
    let path = |stem: &str| files.folder.join(stem).with_extension(files.extension);
    let (cameras_path, images_path, points_path) = (path("cameras"), path("images"), path("points3D"));
    if !points_path.is_file() {
        return Ok(None);
    }
    let (cameras, images, points) = match files.extension {
        "bin" => (binary::cameras(&cameras_path)?, binary::images(&images_path, true)?, binary::points(&points_path)?),
        _ => (text::cameras(&cameras_path)?, text::images(&images_path, true)?, text::points(&points_path)?),
    };
    let places: HashMap<u64, DVec3> = points.into_iter().map(|(id, point)| (id, point.position)).collect();
    let views = join(scene, &cameras_path, &cameras, &images_path, &images)?;
    let seen = |(listed, image): (Listed, ImageRecord)| {
        let points = image.observed.points.into_iter();
        let points = points.filter_map(|(pixel, id)| Some((pixel, *places.get(&id)?))).collect();
        (listed.name.clone(), (listed, points))
    };
    Ok(Some(views.into_iter().zip(images).map(seen).collect()))
}

fn finite(mut points: Vec<Point>, notes: &mut Vec<String>) -> Vec<Point> {
    let before = points.len();
    points.retain(|point| point.position.is_finite() && point.position.abs().max_element() <= FAR);
    if points.len() < before {
        notes.push(format!(
            "left out {} of {before} points whose position is not finite or beyond {FAR:e}",
            before - points.len()
        ));
    }
    points
}

fn join(
    scene: &Place,
    cameras_path: &Path,
    cameras: &[CameraRecord],
    images_path: &Path,
    images: &[ImageRecord],
) -> Result<Vec<Listed>> {
    let mut by_id = HashMap::new();
    for camera in cameras {
        if by_id.insert(camera.id, camera).is_some() {
            return Err(Error::data(cameras_path, format!("camera {}", camera.id), "is listed twice"));
        }
    }
    let (mut ids, mut names) = (HashSet::new(), HashSet::new());
    let mut views = Vec::with_capacity(images.len());
    for image in images {
        let place = format!("image {} (`{}`)", image.id, image.name);
        let twice = || Error::data(images_path, place.as_str(), "has an id or a name that was listed before");
        if !ids.insert(image.id) {
            return Err(twice());
        }
        let Some(camera) = by_id.get(&image.camera) else {
            let problem = format!("uses camera {}, which {} does not list", image.camera, cameras_path.display());
            return Err(Error::data(images_path, place.as_str(), problem));
        };
        let view = listed(scene, images_path, &place, image, cameras_path, camera)?;
        if !names.insert(view.name.clone()) {
            return Err(twice());
        }
        views.push(view);
    }
    Ok(views)
}

fn listed(
    scene: &Place,
    images_path: &Path,
    place: &str,
    image: &ImageRecord,
    cameras_path: &Path,
    record: &CameraRecord,
) -> Result<Listed> {
    let [w, x, y, z] = image.quaternion;
    let quaternion = DQuat::from_xyzw(x, y, z, w);
    let length = quaternion.length();
    if !(length.is_finite() && length > 1e-9) {
        return Err(Error::data(images_path, place, "has a rotation that is zero or not finite"));
    }
    let (mut camera, lens) = record.intrinsics(cameras_path)?;
    camera.rotation = DMat3::from_quat(quaternion.normalize());
    camera.translation = DVec3::from_array(image.translation);
    check_camera(
        cameras_path,
        &format!("camera {}", record.id),
        &Camera { translation: DVec3::ZERO, ..camera.clone() },
        &lens,
    )?;
    check_camera(images_path, place, &camera, &lens)?;
    let file = scene.resolve(images_path, &image.name)?;
    let photo = scene.photos.find(&["images", "."], &file.path);
    Ok(Listed { name: file.name, photo, camera, lens, test: None })
}
