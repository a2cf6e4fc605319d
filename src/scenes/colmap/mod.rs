//! COLMAP sparse models: `cameras`, `images` and `points3D`, binary or text.
//!
//! Poses are camera-from-world with OpenCV axes, and the centre of pixel (0, 0) is at (0.5, 0.5). These are also the
//! conventions of labelgs, so nothing is converted. The `rigs` and `frames` files of newer versions are ignored.

mod binary;
mod model;
mod text;
pub mod write;

use super::listed_path::SceneFolder;
use super::listing::{DISTANCE_MAX, ListedPhoto, Listing, check_camera, require_some};
use super::pose_convention::Native;
use crate::points;
use glam::{DMat3, DQuat, DVec2, DVec3};
use labelgs_files::read;
use labelgs_scene::words::counted;
use labelgs_scene::{Camera, Error, Point, Result, SceneProblem};
use model::{CameraRecord, ImageRecord};
use std::cmp::Reverse;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::{Path, PathBuf};

/// Subfolders of the scene that may contain the model, in order of preference.
const MODEL_FOLDERS: [&str; 4] = ["sparse/0", "sparse", "colmap/sparse/0", "."];

/// The files of a model, each binary or text.
struct ModelFiles {
    folder: PathBuf,
}

impl ModelFiles {
    /// Finds a model below `root`.
    fn find(root: &Path) -> Option<Self> {
        let files = MODEL_FOLDERS.iter().map(|folder| Self { folder: root.join(folder) });
        files.into_iter().find(|files| files.path("cameras").is_some() && files.path("images").is_some())
    }

    /// Returns a file and whether it is binary. All files use the same form: binary if cameras and images have it,
    /// otherwise text.
    fn path(&self, stem: &str) -> Option<(PathBuf, bool)> {
        let file = |stem: &str, extension: &str| Some(self.folder.join(stem).with_extension(extension));
        let is_there = |stem: &str, extension: &str| file(stem, extension).is_some_and(|path| path.is_file());
        let is_whole = |extension: &str| is_there("cameras", extension) && is_there("images", extension);
        let forms = if !is_whole("bin") && is_whole("txt") { ["txt", "bin"] } else { ["bin", "txt"] };
        let form = forms.into_iter().find(|form| is_there(stem, form))?;
        file(stem, form).map(|path| (path, form == "bin"))
    }

    fn needed(&self, stem: &str) -> Result<(PathBuf, bool)> {
        self.path(stem).ok_or_else(|| Error::data(self.folder.join(stem), "", "no longer exists"))
    }

    /// Reads the images, with the cameras that took them.
    fn views(&self, scene: &SceneFolder, with_observations: bool) -> Result<ModelViews> {
        let (cameras_path, is_binary) = self.needed("cameras")?;
        let cameras = if is_binary { binary::cameras(&cameras_path) } else { text::cameras(&cameras_path) }?;
        let (source, is_binary) = self.needed("images")?;
        let images = match is_binary {
            true => binary::images(&source, with_observations)?.into_iter().map(Ok).collect(),
            false => text::images(&source, with_observations)?,
        };
        join(scene, (&cameras_path, &cameras), &source, images)
    }

    /// Reads the points with their ids; `None` without a list. Notes unreadable rows; errors if most rows are
    /// unreadable.
    fn points(&self, notes: &mut Vec<String>) -> Result<Option<Vec<(u64, Point)>>> {
        let Some((path, is_binary)) = self.path("points3D") else { return Ok(None) };
        if is_binary {
            return binary::points(&path).map(Some);
        }
        let (mut points, mut refused) = (Vec::new(), Vec::new());
        for row in text::points(&path)? {
            match row {
                Ok(point) => points.push(point),
                Err(error) => refused.push(error),
            }
        }
        if refused.len() > points.len() {
            return Err(refused.swap_remove(0));
        }
        if let Some(first) = refused.first() {
            notes.push(format!("{} omitted as unreadable, the first: {first}", counted(refused.len(), "point")));
        }
        Ok(Some(points))
    }
}

/// The photos of a model.
struct ModelViews {
    /// Each photo with its row.
    views: Vec<(ListedPhoto, ImageRecord)>,
    /// Photos with unusable poses.
    bad: Vec<Error>,
}

/// Reads the model of the scene, if there is one.
pub fn list(scene: &SceneFolder) -> Result<Option<Listing>> {
    let Some(files) = ModelFiles::find(scene.root) else { return Ok(None) };
    let ModelViews { views, bad } = files.views(scene, false)?;
    let mut notes = Vec::new();
    let points = match files.points(&mut notes)? {
        Some(points) => points.into_iter().map(|(_, point)| point).collect(),
        None => points_of_ply(&files.folder, &mut notes)?,
    };
    let points = finite(points, &mut notes);
    let mut flaws = Vec::new();
    match neighbours(&files.folder, views.len() + bad.len()) {
        Some((is_larger, text)) if is_larger => flaws.push(SceneProblem::Unposed(text)),
        other => notes.extend(other.map(|(_, text)| text)),
    }
    let views = views.into_iter().map(|(listed, _)| listed).collect();
    Ok(Some(Listing { views, points, notes, flaws, bad, ..Listing::new(&files.needed("images")?.0, Native::COLMAP) }))
}

/// What a model holds.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Contents {
    /// Names of the photos that have poses, in the order of the file.
    pub photos: Vec<String>,
    /// Number of points.
    pub points: usize,
}

/// Returns what the model in a folder holds; `None` if that holds no model.
pub fn contents(folder: &Path) -> Result<Option<Contents>> {
    let files = ModelFiles { folder: folder.to_owned() };
    let Some((images, is_binary)) = files.path("images") else { return Ok(None) };
    let images = match is_binary {
        true => binary::images(&images, false)?,
        false => text::images(&images, false)?.into_iter().collect::<Result<_>>()?,
    };
    let points = files.points(&mut Vec::new())?.map_or(0, |points| points.len());
    Ok(Some(Contents { photos: images.into_iter().map(|image| image.name).collect(), points }))
}

/// Reads the points that a trainer wrote beside the model, if the model has none.
fn points_of_ply(folder: &Path, notes: &mut Vec<String>) -> Result<Vec<Point>> {
    let path = folder.join("points3D.ply");
    if !path.is_file() {
        return Ok(Vec::new());
    }
    notes.push(format!("the points come from {}, because there is no points3D.bin or .txt", path.display()));
    points::read_points(&path)
}

/// Describes other models beside `sparse/0`, which has `count` photos, and returns whether one of them is larger.
fn neighbours(folder: &Path, count: usize) -> Option<(bool, String)> {
    let siblings = folder.parent().filter(|_| folder.ends_with("sparse/0")).map(read::folder);
    let others = siblings.and_then(Result::ok).unwrap_or_default().into_iter().filter(|other| other != folder);
    let others = others.filter(|other| other.is_dir()).filter_map(|folder| {
        let (path, is_binary) = ModelFiles { folder: folder.clone() }.path("images")?;
        // A damaged neighbour does not affect this scene.
        let images =
            if is_binary { binary::count(&path) } else { text::images(&path, false).map(|all| all.len() as u64) };
        Some((folder, images.ok()?))
    });
    let (largest, images) = others.max_by_key(|(folder, images)| (*images, Reverse(folder.clone())))?;
    let text = format!(
        "only the model {} is used, with {}; {} has {images}: name that folder as the scene to use it",
        folder.display(),
        counted(count, "photo"),
        largest.display()
    );
    Some((images > count as u64, text))
}

/// A point in a photo, and its world position.
pub type Observation = (DVec2, DVec3);

/// Reads the points that each photo of the COLMAP model with the images `source` shows, by view name. Returns nothing
/// if `source` is not a COLMAP file.
pub fn observations(scene: &SceneFolder, source: &Path) -> Result<BTreeMap<String, (ListedPhoto, Vec<Observation>)>> {
    let files = ModelFiles { folder: source.parent().unwrap_or(scene.root).to_owned() };
    if files.path("images").is_none_or(|(path, _)| path != source) {
        return Ok(BTreeMap::new());
    }
    // Omitted photos were reported when the scene was read.
    let Some(points) = files.points(&mut Vec::new())? else { return Ok(BTreeMap::new()) };
    let places: HashMap<u64, DVec3> = points.into_iter().map(|(id, point)| (id, point.position)).collect();
    let seen = |(listed, image): (ListedPhoto, ImageRecord)| {
        let points = image.observed.into_iter();
        let points = points.filter_map(|(pixel, id)| Some((pixel, *places.get(&id)?))).collect();
        (listed.name.clone(), (listed, points))
    };
    Ok(files.views(scene, true)?.views.into_iter().map(seen).collect())
}

fn finite(mut points: Vec<Point>, notes: &mut Vec<String>) -> Vec<Point> {
    let before = points.len();
    points.retain(|point| point.position.is_finite() && point.position.abs().max_element() <= DISTANCE_MAX);
    if points.len() < before {
        notes.push(format!(
            "left out {} of {before} points whose position is not finite or beyond {DISTANCE_MAX:e}",
            before - points.len()
        ));
    }
    points
}

fn join(
    scene: &SceneFolder,
    (cameras_path, cameras): (&Path, &[CameraRecord]),
    images_path: &Path,
    images: Vec<Result<ImageRecord>>,
) -> Result<ModelViews> {
    let mut by_id = HashMap::new();
    for camera in cameras {
        if by_id.insert(camera.id, camera).is_some() {
            return Err(Error::data(cameras_path, format!("camera {}", camera.id), "is listed twice"));
        }
    }
    let camera = |image: ImageRecord| {
        let place = format!("image {} (`{}`)", image.id, image.name);
        let unlisted = || format!("uses camera {}, which {} does not list", image.camera, cameras_path.display());
        let record = by_id.get(&image.camera).ok_or_else(|| Error::data(images_path, place.as_str(), unlisted()))?;
        let (camera, lens) = record.intrinsics(cameras_path)?;
        check_camera(cameras_path, &format!("camera {}", record.id), &camera, &lens)?;
        let [w, x, y, z] = image.quaternion;
        let quaternion = DQuat::from_xyzw(x, y, z, w);
        let length = quaternion.length();
        if !(length.is_finite() && length > 1e-9) {
            let problem = "has a rotation that is zero or not finite; adjust it again, or remove the image";
            return Err(Error::data(images_path, place, problem));
        }
        let (rotation, translation) = (DMat3::from_quat(quaternion.normalize()), DVec3::from_array(image.translation));
        let camera = Camera { rotation, translation, ..camera };
        check_camera(images_path, &place, &camera, &lens)?;
        Ok((camera, lens, place, image))
    };
    let (mut ids, mut names) = (HashSet::new(), HashSet::new());
    let mut found = ModelViews { views: Vec::with_capacity(images.len()), bad: Vec::new() };
    for image in images {
        let (camera, lens, place, image) = match image.and_then(camera) {
            Ok(posed) => posed,
            Err(error) => {
                found.bad.push(error);
                continue;
            }
        };
        let file = scene.resolve(images_path, &image.name)?;
        if !ids.insert(image.id) || !names.insert(file.name.clone()) {
            return Err(Error::data(images_path, place, "has an id or a name that was listed before"));
        }
        let photo = scene.photos.find(&["images", "."], &file.path);
        found.views.push((ListedPhoto { name: file.name, photo, camera, lens, test: None }, image));
    }
    require_some(found.views.len(), &mut found.bad)?;
    Ok(found)
}
