//! SOG version 2, the compressed format of PlayCanvas: `meta.json` and lossless WebP pictures in an archive. A Gaussian is
//! a pixel, the same in each picture. Labels are one more picture, which `extras` of `meta.json` names.

mod cluster;
mod meta;
mod pictures;
mod read;
mod write;

use super::format::ModelFormat;

/// The format by its ending.
pub(super) const FORMAT: ModelFormat = ModelFormat {
    name: "SOG",
    endings: &[".sog"],
    contents: &["a zip archive"],
    read: read::read,
    write: Some(write::WRITER),
};

/// Values in a codebook.
const CODEBOOK: usize = 256;
/// Entries of the palette in a row of its picture.
const PALETTE_ROW: usize = 64;
/// First alpha of a rotation; which component is the largest follows.
const ROTATION: u8 = 252;
/// Picture with labels: red and green are the id, blue is the confidence.
const LABELS: &str = "labels.webp";
