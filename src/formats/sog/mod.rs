//! SOG version 2, the compressed format of PlayCanvas: an archive with `meta.json` and lossless WebP images. A Gaussian
//! is the same pixel in every image. Labels are an additional image, named in `extras` of `meta.json`.

mod cluster;
mod images;
mod meta;
mod read;
mod write;

use super::format::ModelFormat;

/// The SOG format.
pub(super) const MODEL_FORMAT: ModelFormat = ModelFormat {
    name: "SOG",
    extensions: &[".sog"],
    contents: &["a zip archive"],
    read: read::read,
    write: Some(write::MODEL_WRITER),
};

/// Number of values in a codebook.
const CODEBOOK_SIZE: usize = 256;
/// Number of palette entries per row of the palette image.
const PALETTE_ROW_ENTRIES: usize = 64;
/// Alpha of a rotation whose first component is the largest; larger values mean the following components.
const ROTATION_ALPHA_MIN: u8 = 252;
/// Image with labels: red and green are the id, blue is the confidence.
const LABELS_IMAGE: &str = "labels.webp";
