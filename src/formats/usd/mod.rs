//! USD: prims with the schema `ParticleField3DGaussianSplat` of OpenUSD 26.03, one per label, in a text layer or in a
//! package with one. The number of positions in a prim determines the length of its other attributes.
//!
//! A stage that does not state its unit and up axis would be in centimetres, so labelgs writes both. Binary layers are
//! not supported.

mod layer;
mod read;
mod text;
mod write;
mod xform;

use super::axis_signs::Signs;
use super::format::ModelFormat;

/// The text layer format, with its extensions.
pub(super) const TEXT_FORMAT: ModelFormat = ModelFormat {
    name: "USD",
    extensions: &[".usda", ".usd"],
    contents: &["a USD layer of text"],
    read: read::read,
    write: Some(write::TEXT_WRITER),
};

/// The package format.
pub(super) const PACKAGE_FORMAT: ModelFormat = ModelFormat {
    name: "USDZ",
    extensions: &[".usdz"],
    contents: &["a zip archive"],
    read: read::read_package,
    write: Some(write::PACKAGE_WRITER),
};

/// Axes of a stage with y up: a half turn about x, so that a COLMAP camera at the origin looks in the same direction as
/// a USD camera.
const USD_AXES: Signs = Signs([1.0, -1.0, -1.0]);
/// First bytes of a text layer.
const MAGIC: &str = "#usda 1.0";
/// The schema of a prim with Gaussians.
const SPLATS_SCHEMA: &str = "ParticleField3DGaussianSplat";
/// Attribute names; `h` is appended for 16-bit floats.
const POSITIONS_ATTRIBUTE: &str = "positions";
const ORIENTATIONS_ATTRIBUTE: &str = "orientations";
const SCALES_ATTRIBUTE: &str = "scales";
const OPACITIES_ATTRIBUTE: &str = "opacities";
const HARMONICS_ATTRIBUTE: &str = "radiance:sphericalHarmonicsCoefficients";
const DEGREE_ATTRIBUTE: &str = "radiance:sphericalHarmonicsDegree";
/// Prefix of the attributes with the semantic labels of a prim; the taxonomy follows.
const SEMANTICS_PREFIX: &str = "semantics:labels:";
/// The taxonomy whose labels NVIDIA's simulators draw by default.
const LABEL_TAXONOMY: &str = "class";
const CONFIDENCE_ATTRIBUTE: &str = "labelgs:confidence";
/// The dictionary in `customData` for what the schema cannot store, and its keys: the label id, 0 for none; the SH
/// degree before zeros were added; true for an antialiased model.
const OWN_DICTIONARY: &str = "labelgs";
const OWN_LABEL: &str = "label";
const OWN_DEGREE: &str = "degree";
const OWN_ANTIALIASED: &str = "antialiased";
/// Its keys in `customLayerData`: the initial view, in the axes of labelgs.
const OWN_UP: &str = "up";
const OWN_EYE: &str = "eye";
