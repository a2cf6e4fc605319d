//! The pose convention of a file that deviates from its format.
//!
//! A format defines whether its poses are camera-to-world or world-to-camera, and whether camera axes are OpenCV's (y
//! down, looking along z) or OpenGL's (y up, looking along -z). Some programs write another convention.

use glam::{DMat3, DQuat, DVec3};
use labelgs_scene::Camera;
use labelgs_scene::options::Numbers;
use serde::{Deserialize, Serialize};
use std::fmt::{self, Display};
use std::str::FromStr;

/// The direction of a pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Direction {
    CameraToWorld,
    WorldToCamera,
}

/// Camera axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Axes {
    OpenCv,
    OpenGl,
}

/// Deviations of a file's poses from its format: comma-separated words `c2w` or `w2c` (camera-to-world,
/// world-to-camera), `opencv` or `opengl` (camera axes) and `xyzw` (quaternions with the real part last). Everything
/// else is as in the format.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct PoseConvention {
    direction: Option<Direction>,
    axes: Option<Axes>,
    /// Whether quaternions are (x, y, z, w).
    is_xyzw: bool,
}

/// The convention of a format.
#[derive(Clone, Copy, Debug)]
pub struct Native(Direction, Axes);

impl Native {
    /// COLMAP's images.
    pub const COLMAP: Self = Self(Direction::WorldToCamera, Axes::OpenCv);
    /// The transforms of Blender, instant-ngp and nerfstudio.
    pub const TRANSFORMS: Self = Self(Direction::CameraToWorld, Axes::OpenGl);
    /// Metashape's transforms, and LLFF's poses after its reader has turned them.
    pub const CAMERA_TO_WORLD: Self = Self(Direction::CameraToWorld, Axes::OpenCv);

    /// Returns the other conventions that the file may use, those with fewer differences first.
    pub fn others(self) -> Vec<PoseConvention> {
        let Self(direction, axes) = self;
        let turned = match direction {
            Direction::CameraToWorld => Direction::WorldToCamera,
            Direction::WorldToCamera => Direction::CameraToWorld,
        };
        let swapped = if axes == Axes::OpenCv { Axes::OpenGl } else { Axes::OpenCv };
        let of = |direction, axes, is_xyzw| PoseConvention { direction, axes, is_xyzw };
        let mut all =
            vec![of(None, Some(swapped), false), of(Some(turned), None, false), of(Some(turned), Some(swapped), false)];
        if direction == Direction::WorldToCamera {
            // Only COLMAP stores quaternions.
            all.push(of(None, None, true));
            all.push(of(None, Some(swapped), true));
            all.push(of(Some(turned), None, true));
        }
        all
    }
}

/// A rigid motion: rotation, then translation.
type Motion = (DMat3, DVec3);

fn inverse((rotation, translation): Motion) -> Motion {
    (rotation.transpose(), -(rotation.transpose() * translation))
}

/// Converts OpenGL's axes to OpenCV's and back.
const AXES_SWAP: DMat3 = DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));

impl PoseConvention {
    /// Returns true if the convention is the format's.
    pub fn is_native(self) -> bool {
        self == Self::default()
    }

    /// Corrects a camera that was read by the convention of its format.
    pub fn apply(self, native: Native, camera: &mut Camera) {
        if self.is_native() {
            return;
        }
        let Native(direction, axes) = native;
        // The pose as stored in the file.
        let mut file = (camera.rotation, camera.translation);
        if axes == Axes::OpenGl {
            file = (AXES_SWAP * file.0, AXES_SWAP * file.1);
        }
        if direction == Direction::CameraToWorld {
            file = inverse(file);
        }
        if self.is_xyzw {
            let read = DQuat::from_mat3(&file.0);
            file.0 = DMat3::from_quat(DQuat::from_xyzw(read.w, read.x, read.y, read.z));
        }
        if self.direction.unwrap_or(direction) == Direction::CameraToWorld {
            file = inverse(file);
        }
        if self.axes.unwrap_or(axes) == Axes::OpenGl {
            file = (AXES_SWAP * file.0, AXES_SWAP * file.1);
        }
        (camera.rotation, camera.translation) = file;
    }

    /// Returns the words to type, with their meanings.
    fn words(self) -> impl Iterator<Item = (&'static str, &'static str)> {
        let direction = self.direction.map(|direction| match direction {
            Direction::CameraToWorld => ("c2w", "camera-to-world poses"),
            Direction::WorldToCamera => ("w2c", "world-to-camera poses"),
        });
        let axes = self.axes.map(|axes| match axes {
            Axes::OpenCv => ("opencv", "OpenCV camera axes"),
            Axes::OpenGl => ("opengl", "OpenGL camera axes"),
        });
        let order = self.is_xyzw.then_some(("xyzw", "quaternions with the real part last"));
        [direction, axes, order].into_iter().flatten()
    }

    /// Returns a description of the convention.
    pub fn text(self) -> String {
        let all: Vec<&str> = self.words().map(|(_, meaning)| meaning).collect();
        if all.is_empty() { "the convention of its format".to_owned() } else { all.join(" and ") }
    }
}

impl Display for PoseConvention {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let words: Vec<&str> = self.words().map(|(word, _)| word).collect();
        out.write_str(&words.join(","))
    }
}

impl FromStr for PoseConvention {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut found = Self::default();
        for word in text.split(',').map(str::trim).filter(|word| !word.is_empty()) {
            let is_new = match word.to_ascii_lowercase().as_str() {
                "c2w" => found.direction.replace(Direction::CameraToWorld).is_none(),
                "w2c" => found.direction.replace(Direction::WorldToCamera).is_none(),
                "opencv" => found.axes.replace(Axes::OpenCv).is_none(),
                "opengl" => found.axes.replace(Axes::OpenGl).is_none(),
                "xyzw" => !std::mem::replace(&mut found.is_xyzw, true),
                _ => {
                    return Err(format!(
                        "`{word}` is not a pose convention; expected c2w, w2c, opencv, opengl or xyzw"
                    ));
                }
            };
            if !is_new {
                return Err(format!("`{word}` contradicts or repeats the words before it"));
            }
        }
        Ok(found)
    }
}

impl Numbers for PoseConvention {
    fn numbers(&self) -> Vec<f64> {
        Vec::new()
    }
}

impl TryFrom<String> for PoseConvention {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

impl From<PoseConvention> for String {
    fn from(convention: PoseConvention) -> Self {
        convention.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(rotation: DMat3, translation: DVec3) -> Camera {
        Camera { rotation, translation, fx: 1.0, fy: 1.0, cx: 1.0, cy: 1.0, width: 2, height: 2 }
    }

    /// A pose that was written in each convention, read by the format's, and corrected.
    #[test]
    fn each_convention_gives_the_pose_back() {
        let right = DQuat::from_xyzw(0.1, -0.5, 0.3, 0.8).normalize();
        let (rotation, translation) = (DMat3::from_quat(right), DVec3::new(0.4, -2.0, 3.0));
        for text in ["", "opengl", "c2w", "c2w,opengl"] {
            let convention: PoseConvention = text.parse().expect("words");
            let (mut stored, native) = ((rotation, translation), Native::COLMAP);
            if text.contains("opengl") {
                stored = (AXES_SWAP * stored.0, AXES_SWAP * stored.1);
            }
            if text.contains("c2w") {
                stored = inverse(stored);
            }
            let mut read = camera(stored.0, stored.1);
            convention.apply(native, &mut read);
            assert!(read.rotation.abs_diff_eq(rotation, 1e-12), "{text}");
            assert!(read.translation.abs_diff_eq(translation, 1e-12), "{text}");
        }
        // What COLMAP's order makes of (x, y, z, w).
        let wrong = DQuat::from_xyzw(right.y, right.z, right.w, right.x);
        let mut read = camera(DMat3::from_quat(wrong), translation);
        "xyzw".parse::<PoseConvention>().expect("words").apply(Native::COLMAP, &mut read);
        assert!(read.rotation.abs_diff_eq(rotation, 1e-12));
    }

    #[test]
    fn transforms_may_mean_other_poses() {
        let native = Native::TRANSFORMS;
        let (rotation, translation) = (DMat3::from_rotation_y(0.3), DVec3::new(0.4, -2.0, 3.0));
        let world_from_camera = inverse((rotation, translation));
        // The reader takes the file's matrix for camera-to-world with OpenGL axes.
        let read = |(rotation, translation): Motion| {
            let (rotation, translation) = inverse((rotation, translation));
            camera(AXES_SWAP * rotation, AXES_SWAP * translation)
        };
        for (text, stored) in [("opencv", world_from_camera), ("w2c,opencv", (rotation, translation))] {
            let mut found = read(stored);
            text.parse::<PoseConvention>().expect("words").apply(native, &mut found);
            assert!(found.rotation.abs_diff_eq(rotation, 1e-12), "{text}");
            assert!(found.translation.abs_diff_eq(translation, 1e-12), "{text}");
        }
    }

    #[test]
    fn words_are_read_and_written() {
        for text in ["", "c2w", "w2c,opengl", "opencv,xyzw"] {
            assert_eq!(text.parse::<PoseConvention>().expect("words").to_string(), text);
        }
        assert!("c2w,w2c".parse::<PoseConvention>().is_err());
        assert!("blender".parse::<PoseConvention>().is_err());
    }
}
