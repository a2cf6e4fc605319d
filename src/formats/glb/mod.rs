//! GLB with `KHR_gaussian_splatting`: a glTF in one file whose points are Gaussians. Labels are feature ids
//! (`EXT_mesh_features`), which refer to rows of a table of ids and names (`EXT_structural_metadata`).
//!
//! A GLB is a header of 12 bytes, a JSON chunk and a binary chunk. Accessors in the JSON are views of the binary chunk.

mod file;
mod mesh;
mod nodes;
mod read;
mod write;

pub use mesh::{Mesh, write_meshes};

use super::axis_signs::Signs;
use super::format::ModelFormat;

/// The GLB format.
pub(super) const MODEL_FORMAT: ModelFormat = ModelFormat {
    name: "GLB",
    extensions: &[".glb"],
    contents: &["a GLB"],
    read: read::read,
    write: Some(write::MODEL_WRITER),
};

/// glTF axes as its viewers show a model with COLMAP's axes: turned about z, so that y points up.
const GLTF_AXES: Signs = Signs([-1.0, -1.0, 1.0]);
/// The extension of a primitive with Gaussians.
const SPLATS_EXTENSION: &str = "KHR_gaussian_splatting";
const ROTATION_ATTRIBUTE: &str = "KHR_gaussian_splatting:ROTATION";
const SCALE_ATTRIBUTE: &str = "KHR_gaussian_splatting:SCALE";
const OPACITY_ATTRIBUTE: &str = "KHR_gaussian_splatting:OPACITY";
/// Row of each Gaussian in the label table; row 0 means no object.
const FEATURE_ATTRIBUTE: &str = "_FEATURE_ID_0";
/// Largest feature id: floats represent all integers up to it.
const FEATURE_MAX: f32 = 16_777_215.0;
const CONFIDENCE_ATTRIBUTE: &str = "_LABEL_CONFIDENCE";
/// Key in the extras of a primitive: true for an antialiased model. The extension has no such key.
const ANTIALIASED_KEY: &str = "antialiased";
/// Keys in the extras of a primitive: up direction and eye position of the initial view, in the world and axes of
/// labelgs.
const UP_KEY: &str = "labelgs_up";
const EYE_KEY: &str = "labelgs_eye";
const FEATURES_EXTENSION: &str = "EXT_mesh_features";
const METADATA_EXTENSION: &str = "EXT_structural_metadata";
/// Accessor component type of 32-bit floats.
const FLOAT_COMPONENT: u64 = 5126;

/// Returns the attribute of a coefficient; `index` counts from 0 within its degree.
fn harmonic(degree: u32, index: u32) -> String {
    format!("KHR_gaussian_splatting:SH_DEGREE_{degree}_COEF_{index}")
}

/// Returns the attributes of all coefficients of degrees 1 to `sh_degree`, in the order of
/// [`Gaussians`](labelgs_scene::Gaussians).
fn harmonics(sh_degree: u32) -> impl Iterator<Item = String> {
    (1..=sh_degree).flat_map(|degree| (0..2 * degree + 1).map(move |index| harmonic(degree, index)))
}
