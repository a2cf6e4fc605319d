//! The file `meta.json` of a SOG.

use labelgs_files::label_table::LabelTable;
use serde::{Deserialize, Serialize};

pub(super) const META_FILE: &str = "meta.json";
pub(super) const VERSION: u32 = 2;
/// [`Meta::model`] of an antialiased model.
pub(super) const ANTIALIASED_MODEL: &str = "antialiased";
/// Version of the labelgs extras.
pub(super) const EXTRAS_VERSION: u32 = 1;

#[derive(Debug, Deserialize, Serialize)]
pub(super) struct Meta {
    #[serde(default)]
    pub(super) version: u32,
    #[serde(default)]
    pub(super) asset: Asset,
    pub(super) count: usize,
    /// `antialiased` or absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) model: Option<String>,
    /// The same in older files.
    #[serde(default, skip_serializing)]
    pub(super) antialias: bool,
    pub(super) means: Means,
    pub(super) scales: CodebookIndices,
    pub(super) quats: Files,
    pub(super) sh0: CodebookIndices,
    #[serde(rename = "shN", default, skip_serializing_if = "Option::is_none")]
    pub(super) rest: Option<Palette>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) extras: Option<Extras>,
}

#[derive(Debug, Default, Deserialize, Serialize)]
pub(super) struct Asset {
    #[serde(default)]
    pub(super) generator: String,
}

/// Positions: bounds of their logarithms, and images of the low and high bytes.
#[derive(Debug, Deserialize, Serialize)]
pub(super) struct Means {
    pub(super) mins: [f64; 3],
    pub(super) maxs: [f64; 3],
    pub(super) files: [String; 2],
}

#[derive(Debug, Deserialize, Serialize)]
pub(super) struct Files {
    pub(super) files: [String; 1],
}

/// Indices into a codebook.
#[derive(Debug, Deserialize, Serialize)]
pub(super) struct CodebookIndices {
    pub(super) codebook: Vec<f32>,
    pub(super) files: [String; 1],
}

/// Harmonics: images of the palette entries, and of the entry of each Gaussian.
#[derive(Debug, Deserialize, Serialize)]
pub(super) struct Palette {
    pub(super) count: usize,
    pub(super) bands: u32,
    pub(super) codebook: Vec<f32>,
    pub(super) files: [String; 2],
}

#[derive(Debug, Deserialize, Serialize)]
pub(super) struct Extras {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) labelgs: Option<Labels>,
    #[serde(rename = "labelgs_view", default, skip_serializing_if = "Option::is_none")]
    pub(super) view: Option<View>,
}

/// The initial view, in the world and axes of labelgs.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
pub(super) struct View {
    pub(super) up: [f64; 3],
    pub(super) eye: [f64; 3],
}

#[derive(Debug, Deserialize, Serialize)]
pub(super) struct Labels {
    pub(super) version: u32,
    pub(super) file: String,
    /// Whether the blue channel of the image is the confidence.
    pub(super) confidence: bool,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) names: Option<LabelTable>,
}
