//! The content of a transforms file.

use labelgs_files::read;
use labelgs_scene::{Error, Result, Setting};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};
use std::path::Path;

const EXPECTED_FORM: &str = "expected an object with \"frames\", each with \"file_path\" and \"transform_matrix\", as Blender, \
                        instant-ngp and nerfstudio write it";

/// Intrinsics of the whole file or of a frame.
#[derive(Clone, Debug, Default, Deserialize)]
pub(super) struct Intrinsics {
    pub(super) camera_angle_x: Option<f64>,
    pub(super) camera_angle_y: Option<f64>,
    pub(super) fl_x: Option<f64>,
    pub(super) fl_y: Option<f64>,
    pub(super) cx: Option<f64>,
    pub(super) cy: Option<f64>,
    pub(super) w: Option<f64>,
    pub(super) h: Option<f64>,
    pub(super) k1: Option<f64>,
    pub(super) k2: Option<f64>,
    pub(super) k3: Option<f64>,
    pub(super) k4: Option<f64>,
    pub(super) k5: Option<f64>,
    pub(super) k6: Option<f64>,
    pub(super) p1: Option<f64>,
    pub(super) p2: Option<f64>,
    pub(super) sx1: Option<f64>,
    pub(super) sy1: Option<f64>,
    /// k1, k2, k3, k4, p1 and p2, which take precedence over the named coefficients in nerfstudio.
    pub(super) distortion_params: Option<Vec<f64>>,
    pub(super) camera_model: Option<String>,
    pub(super) is_fisheye: Option<bool>,
    /// instant-ngp's panoramas.
    pub(super) latlong: Option<bool>,
    /// A lens of instant-ngp.
    pub(super) ftheta_p0: Option<f64>,
    /// Mitsuba's axes of the camera.
    pub(super) from_mitsuba: Option<bool>,
}

impl Intrinsics {
    /// Returns the values of the frame, completed by the file's.
    pub(super) fn or(&self, file: &Self) -> Self {
        macro_rules! merged {
            ($($field:ident)*) => { Self { $($field: self.$field.clone().or(file.$field.clone())),* } };
        }
        let mut all = merged!(camera_angle_x camera_angle_y fl_x fl_y cx cy w h k1 k2 k3 k4 k5 k6 p1 p2 sx1 sy1
            distortion_params camera_model is_fisheye latlong ftheta_p0 from_mitsuba);
        // An angle of the frame takes precedence over a length of the file.
        if self.fl_x.or(self.fl_y).is_none() && self.camera_angle_x.or(self.camera_angle_y).is_some() {
            (all.fl_x, all.fl_y) = (None, None);
            (all.camera_angle_x, all.camera_angle_y) = (self.camera_angle_x, self.camera_angle_y);
        }
        all
    }
}

#[derive(Debug, Deserialize)]
pub(super) struct Frame {
    pub(super) file_path: String,
    /// `None` stands for NaN and infinity.
    pub(super) transform_matrix: Vec<Vec<Option<f64>>>,
    /// ScanNet++'s mark for blurred photos.
    pub(super) is_bad: Option<bool>,
    #[serde(flatten)]
    pub(super) intrinsics: Intrinsics,
    #[serde(flatten)]
    pub(super) rest: Map<String, Value>,
}

#[derive(Debug, Deserialize)]
#[serde(expecting = "an object")]
pub(super) struct Transforms {
    /// Each is a [`Frame`], parsed separately: a bad one only costs its photo.
    pub(super) frames: Vec<Value>,
    /// The held-out frames of ScanNet++.
    pub(super) test_frames: Option<Vec<Value>>,
    pub(super) ply_file_path: Option<String>,
    pub(super) applied_transform: Option<Vec<Vec<f64>>>,
    pub(super) train_filenames: Option<Vec<String>>,
    pub(super) val_filenames: Option<Vec<String>>,
    pub(super) test_filenames: Option<Vec<String>>,
    #[serde(flatten)]
    pub(super) intrinsics: Intrinsics,
    #[serde(flatten)]
    pub(super) rest: Map<String, Value>,
}

pub(super) fn read(path: &Path) -> Result<Transforms> {
    let text = read::text(path)?;
    read::parse_json(path, &without_non_finite(text.as_bytes()), EXPECTED_FORM)
}

/// Parses a part of the file; `place` names it.
pub(super) fn part<T: DeserializeOwned>(path: &Path, place: &str, value: &Value) -> Result<T> {
    T::deserialize(value).map_err(|error| Error::data(path, place, error.to_string().replace('`', "\"")))
}

/// Replaces NaN and infinities, which Python writes and JSON does not have, by null.
fn without_non_finite(text: &[u8]) -> Vec<u8> {
    let (mut out, mut rest, mut is_string) = (Vec::with_capacity(text.len()), text, false);
    while let Some((&byte, behind)) = rest.split_first() {
        let word = ["NaN", "-Infinity", "Infinity"].iter().find(|word| rest.starts_with(word.as_bytes()));
        if let Some(word) = word.filter(|_| !is_string) {
            out.extend(b"null");
            rest = &rest[word.len()..];
            continue;
        }
        let taken = match byte {
            b'\\' if is_string => 2.min(rest.len()),
            _ => 1,
        };
        is_string ^= byte == b'"';
        out.extend(&rest[..taken]);
        rest = if taken == 1 { behind } else { &rest[taken..] };
    }
    out
}

/// Notes unused keys that would change a view.
pub(super) fn note_unused(transforms: &Transforms, frames: &[Frame], notes: &mut Vec<String>) {
    let is_set = |value: &&Value| match value {
        Value::Null | Value::Bool(false) => false,
        Value::Array(all) => all.iter().any(|value| value.as_f64() != Some(0.0)),
        Value::Number(number) => number.as_f64() != Some(0.0),
        _ => true,
    };
    let unused = [
        (
            "mask_path",
            format!("id masks come from the folder {}, ignore masks from {}", Setting("masks"), Setting("ignore")),
        ),
        ("depth_file_path", format!("known depths come from the folder {}", Setting("depths"))),
        ("time", "the scene is assumed to be static".to_owned()),
        ("rolling_shutter", "photos are assumed to be taken at a single moment".to_owned()),
        ("white_transparent", "store the photos with their opacity".to_owned()),
        ("mask_color", "store the photos with their opacity".to_owned()),
    ];
    for (key, cure) in unused {
        let of_frames = frames.iter().filter(|frame| frame.rest.get(key).filter(is_set).is_some()).count();
        if of_frames > 0 || transforms.rest.get(key).filter(is_set).is_some() {
            notes.push(format!("\"{key}\" of the transforms is not used; {cure}"));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::without_non_finite;

    #[test]
    fn non_finite_numbers_of_python_become_null() {
        let text = br#"{"NaN": [NaN,-Infinity, 1e3], "a\"Infinity": Infinity}"#;
        let expected = br#"{"NaN": [null,null, 1e3], "a\"Infinity": null}"#;
        assert_eq!(without_non_finite(text).escape_ascii().to_string(), expected.escape_ascii().to_string());
    }
}
