//! GLB with `KHR_gaussian_splatting`: a glTF in one file, whose points are Gaussians. Labels are feature ids
//! (`EXT_mesh_features`), rows of a table of ids and names (`EXT_structural_metadata`).
//!
//! A GLB is a header of 12 bytes, a chunk of JSON and a chunk of numbers, on which accessors in the JSON are views.

mod file;
mod mesh;
mod nodes;
mod read;
mod write;

pub use mesh::{Mesh, write_meshes};

use super::format::ModelFormat;
use super::turn::Signs;

/// The format by its ending.
pub(super) const FORMAT: ModelFormat =
    ModelFormat { name: "GLB", endings: &[".glb"], contents: &["a GLB"], read: read::read, write: Some(write::WRITER) };

/// Axes of glTF as its viewers show a model of COLMAP's axes: turned about z, so that y is up.
const AXES: Signs = Signs([-1.0, -1.0, 1.0]);
/// The extension of a primitive.
const SPLATS: &str = "KHR_gaussian_splatting";
const ROTATION: &str = "KHR_gaussian_splatting:ROTATION";
const SCALE: &str = "KHR_gaussian_splatting:SCALE";
const OPACITY: &str = "KHR_gaussian_splatting:OPACITY";
/// Rows of the table of labels; row 0 is no object.
const FEATURE: &str = "_FEATURE_ID_0";
/// Largest value of it: floats hold all whole numbers up to it.
const FEATURE_MAX: f32 = 16_777_215.0;
const CONFIDENCE: &str = "_LABEL_CONFIDENCE";
/// Key of the extras of a primitive: true for an antialiased model. The extension has none.
const ANTIALIASED: &str = "antialiased";
/// Keys of the extras of a primitive: the way up and the place of the eye at first, in the world and the axes of labelgs.
const UP: &str = "labelgs_up";
const EYE: &str = "labelgs_eye";
const FEATURES: &str = "EXT_mesh_features";
const METADATA: &str = "EXT_structural_metadata";
/// Accessor component type of 32-bit floats.
const FLOAT: u64 = 5126;

/// The attribute of a coefficient; `index` counts from 0 within its degree.
fn harmonic(degree: u32, index: u32) -> String {
    format!("KHR_gaussian_splatting:SH_DEGREE_{degree}_COEF_{index}")
}

/// The attributes of all coefficients above degree 0 up to a degree, in the order of ours.
fn harmonics(sh_degree: u32) -> impl Iterator<Item = String> {
    (1..=sh_degree).flat_map(|degree| (0..2 * degree + 1).map(move |index| harmonic(degree, index)))
}
