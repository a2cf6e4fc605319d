//! The content of a scene before its pixels, and the checks that all formats share.

use super::lens::Lens;
use super::photo_finder::PHOTO_EXTENSIONS;
use super::pose_convention::Native;
use glam::{DMat3, DQuat, DVec3};
use labelgs_scene::words::counted;
use labelgs_scene::{Camera, Error, Point, Result, SceneProblem};
use std::path::{Path, PathBuf};

/// Largest side of a camera, px.
const SIDE_MAX: u32 = 1 << 17;

/// Largest distance of a camera or a point from the origin, world units: squares still fit into f32.
pub const DISTANCE_MAX: f64 = 1e12;

/// Largest side of a photo in focal lengths. A pinhole of 179 degrees has 115, and other lenses have at most 2 pi.
const SIDE_FOCALS_MAX: f64 = 115.0;

/// A photo in the listing of a scene.
#[derive(Clone, Debug)]
pub struct ListedPhoto {
    /// Name relative to the folder of photos.
    pub name: String,
    /// Its file; `None` if it does not exist.
    pub photo: Option<PathBuf>,
    /// Camera at the size in the data set.
    pub camera: Camera,
    pub lens: Lens,
    /// Whether the photo is held out; `None` until something decides it.
    pub test: Option<bool>,
}

/// A scene before its pixels are read.
#[derive(Debug)]
pub struct Listing {
    /// The file that lists the photos.
    pub source: PathBuf,
    /// The pose convention of the format.
    pub native: Native,
    pub views: Vec<ListedPhoto>,
    /// Names of photos without a file and without a known size.
    pub missing: Vec<String>,
    /// Errors of photos or poses that cannot be used.
    pub bad: Vec<Error>,
    pub points: Vec<Point>,
    pub notes: Vec<String>,
    /// Problems of the list that notes do not mention.
    pub flaws: Vec<SceneProblem>,
    /// Where photos were looked for, if some were not found.
    pub hint: String,
}

impl Listing {
    /// Creates an empty listing for a file.
    pub fn new(source: &Path, native: Native) -> Self {
        Self {
            source: source.to_owned(),
            native,
            views: Vec::new(),
            missing: Vec::new(),
            bad: Vec::new(),
            points: Vec::new(),
            notes: Vec::new(),
            flaws: Vec::new(),
            hint: String::new(),
        }
    }

    /// Notes each non-zero count of things called `noun` in a file, with its description.
    pub fn note_counts(&mut self, path: &Path, noun: &str, counts: &[(usize, &str)]) {
        for (count, what) in counts.iter().filter(|(count, _)| *count > 0) {
            self.notes.push(format!("{} of {} {what}", counted(count, noun), path.display()));
        }
    }

    /// Returns true if some of the photos do not exist.
    pub fn is_incomplete(&self) -> bool {
        !self.missing.is_empty() || self.views.iter().any(|view| view.photo.is_none())
    }
}

/// Refuses a list without a usable photo: the file then has the error of its first photo.
pub fn require_some(views: usize, bad: &mut Vec<Error>) -> Result<()> {
    if views == 0 && !bad.is_empty() { Err(bad.swap_remove(0)) } else { Ok(()) }
}

/// Refuses cameras that cannot form an image. `place` names the camera in `path`.
pub fn check_camera(path: &Path, place: &str, camera: &Camera, lens: &Lens) -> Result<()> {
    let refuse = |problem: String| Err(Error::data(path, place, problem));
    let Camera { fx, fy, cx, cy, width, height, .. } = *camera;
    if width == 0 || height == 0 || width > SIDE_MAX || height > SIDE_MAX {
        return refuse(format!("image size {width} x {height} px; sides from 1 to {SIDE_MAX} are supported"));
    }
    if !(fx > 0.0 && fy > 0.0 && fx.is_finite() && fy.is_finite()) {
        return refuse(format!("focal lengths {fx} and {fy} px; both must be positive numbers"));
    }
    // Half the side divided by the focal length is the tangent of half the field of view.
    let widest = (f64::from(width) / fx).max(f64::from(height) / fy);
    if widest > SIDE_FOCALS_MAX {
        let hint = if fx < 10.0 { "; if it is a share of the photo's size, multiply it by that" } else { "" };
        return refuse(format!(
            "focal lengths {fx} and {fy} px make a field of view of 180 degrees; a pinhole must be narrower{hint}"
        ));
    }
    let narrowest = (f64::from(width) / fx).min(f64::from(height) / fy);
    if narrowest < 1e-6 {
        return refuse(format!(
            "focal lengths {fx} and {fy} px are a million times the image of {width} x {height} px; they are in px"
        ));
    }
    if !(0.0..=f64::from(width)).contains(&cx) || !(0.0..=f64::from(height)).contains(&cy) {
        return refuse(format!("principal point ({cx}, {cy}) lies outside the image of {width} x {height} px"));
    }
    if lens.projection().is_some_and(|lens| !lens.is_valid()) {
        return refuse(format!(
            "{lens:?} is not a lens; expected finite coefficients in the range of the camera model"
        ));
    }
    if !camera.translation.is_finite() || !camera.rotation.is_finite() {
        return refuse("the pose is not finite".into());
    }
    if camera.translation.length() > DISTANCE_MAX {
        return refuse(format!("the camera is farther than {DISTANCE_MAX:e} from the origin; move the scene to it"));
    }
    Ok(())
}

/// Returns the rotation nearest to `matrix`, which may have a uniform scale; `None` if it is not a rotation.
pub fn rotation_of(matrix: DMat3) -> Option<DMat3> {
    let determinant = matrix.determinant();
    if !(determinant.is_finite() && determinant > 0.0) {
        return None;
    }
    let unit = matrix * (1.0 / determinant.cbrt());
    let gram = unit.transpose() * unit - DMat3::IDENTITY;
    if gram.to_cols_array().iter().any(|value| value.is_nan() || value.abs() > 1e-2) {
        return None;
    }
    Some(DMat3::from_quat(DQuat::from_mat3(&unit).normalize()))
}

/// Converts an OpenCV camera-to-world pose to camera-from-world.
pub fn invert_pose(rotation: DMat3, centre: DVec3) -> (DMat3, DVec3) {
    let inverse = rotation.transpose();
    (inverse, -(inverse * centre))
}

/// Appends the file's extension to the name of a view listed without one. Otherwise `frame.0001` would later lose its
/// number.
pub fn with_extension(mut name: String, photo: Option<&Path>) -> String {
    if let Some(found) = photo.and_then(|photo| photo.to_str()) {
        name.push_str(
            PHOTO_EXTENSIONS.iter().rev().find(|ext| found.ends_with(&format!("{name}{ext}"))).unwrap_or(&""),
        );
    }
    name
}

/// Converts a photo side, px, that is stored as a float.
pub fn side(path: &Path, place: &str, value: f64) -> Result<u32> {
    if value.fract() == 0.0 && (1.0..=f64::from(u32::MAX)).contains(&value) {
        return Ok(value as u32);
    }
    Err(Error::data(path, place, format!("image side {value} is not a positive whole number")))
}
