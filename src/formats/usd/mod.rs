//! USD: prims of the schema `ParticleField3DGaussianSplat` of OpenUSD 26.03, one for each label, in a layer of text or in a
//! package of it. Other attributes of a prim follow its number of positions.
//!
//! A stage without a unit and an axis of its own would be in centimetres, so both are written. Layers of the binary form are
//! not read.

mod layer;
mod place;
mod read;
mod text;
mod write;

use super::format::ModelFormat;
use super::turn::Signs;

/// Layers of text by their endings.
pub(super) const TEXT: ModelFormat = ModelFormat {
    name: "USD",
    endings: &[".usda", ".usd"],
    contents: &["a USD layer of text"],
    read: read::read,
    write: Some(write::TEXT),
};

/// Packages by their ending.
pub(super) const PACKAGE: ModelFormat = ModelFormat {
    name: "USDZ",
    endings: &[".usdz"],
    contents: &["a zip archive"],
    read: read::read_package,
    write: Some(write::PACKAGE),
};

/// Axes of a stage whose y is up: a half turn about x, so that a camera of COLMAP at the origin looks as one of USD does.
const AXES: Signs = Signs([1.0, -1.0, -1.0]);
/// First bytes of a layer of text.
const MAGIC: &str = "#usda 1.0";
/// The schema of a prim with Gaussians.
const SPLATS: &str = "ParticleField3DGaussianSplat";
/// Each with the letter h at its end if it has 16-bit floats.
const POSITIONS: &str = "positions";
const ORIENTATIONS: &str = "orientations";
const SCALES: &str = "scales";
const OPACITIES: &str = "opacities";
const HARMONICS: &str = "radiance:sphericalHarmonicsCoefficients";
const DEGREE: &str = "radiance:sphericalHarmonicsDegree";
/// Start of the attributes with what a prim shows; the taxonomy follows.
const SEMANTICS: &str = "semantics:labels:";
/// The taxonomy whose labels the simulators of NVIDIA draw without further settings.
const TAXONOMY: &str = "class";
const CONFIDENCE: &str = "labelgs:confidence";
/// The dictionary in `customData` with what the schema has no place for, and its keys: the id of the label, 0 for none; the
/// degree of harmonics before zeros were added; true for an antialiased model.
const OWN: &str = "labelgs";
const OWN_LABEL: &str = "label";
const OWN_DEGREE: &str = "degree";
const OWN_ANTIALIASED: &str = "antialiased";
/// Its keys in `customLayerData`: where the model is seen from at first, in its own axes.
const OWN_UP: &str = "up";
const OWN_EYE: &str = "eye";
