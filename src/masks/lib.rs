//! Folders of masks: [`import`] converts the formats of trackers, segmenters, annotation tools and data sets, [`inspect`]
//! checks a folder.
//!
//! Our own format is one grey PNG per photo with the photo's name, whose pixel value is the id, and a `labels.json`
//! ([`LabelTable`](labelgs_files::LabelTable)).

pub mod check;
mod coco;
mod content;
mod decode;
mod detect;
pub mod explain;
mod folder;
mod import;
mod inspect;
mod marks;
pub mod mask;
pub mod mask_folder;
pub mod nested;
mod photos;
mod polygon;
mod pred;
mod rle;
mod sam;
pub mod soft_edges;
mod spans;
pub mod tools;

pub use check::{Finding, Problem};
pub use import::{Imported, Objects, Overlaps, import};
pub use inspect::{Report, inspect};
pub use mask::read_mask;

use labelgs_files::names::shortened;
use labelgs_scene::View;
use labelgs_scene::words::name_of;
use serde::Serialize;
use std::path::PathBuf;

fn names<'a>(views: &[&'a View]) -> Vec<&'a str> {
    views.iter().map(|view| view.name.as_str()).collect()
}

/// The format of a folder of masks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "kebab-case")]
pub enum Format {
    /// The format that fits, if only one does.
    #[default]
    Auto,
    /// DEVA with --use_short_id: 8-bit grey, the value is the id.
    DevaShort,
    /// DEVA with default settings: RGB, the id is R + 256 G + 65536 B.
    DevaLong,
    /// Palette images as in DAVIS: the index is the id.
    Palette,
    /// 16-bit grey, the value is the id.
    Grey16,
    /// A black and white image per photo, of one object: NAME.png.
    Binary,
    /// A folder per object with a black and white image per photo: OBJECT/NAME.png.
    BinaryFolders,
    /// A folder per photo with a black and white image per object: NAME/OBJECT.png.
    PhotoFolders,
    /// `object_mask` of Gaussian Grouping: 8-bit grey, the value is the id.
    ObjectMask,
    /// `test_mask` of LERF-Mask: NAME/OBJECT.png.
    LerfMask,
    /// `segmentations` of 3D-OVS: NAME/OBJECT.png and classes.txt.
    #[serde(rename = "3d-ovs")]
    #[cfg_attr(feature = "cli", value(name = "3d-ovs"))]
    ThreeDOvs,
    /// JSON with instances as in COCO, also as CVAT and Label Studio export it.
    Coco,
    /// Folders of Segment Anything's amg.py: NAME/0.png and NAME/metadata.csv.
    SamFolders,
    /// Run lengths of Segment Anything's amg.py: NAME.json.
    SamJson,
}

impl Format {
    /// Returns the name in settings and messages.
    pub fn name(self) -> String {
        name_of(&self)
    }
}

/// The rule for pixels that two masks of a photo share. Crowds of COCO yield to all others.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "kebab-case")]
pub enum Overlap {
    /// That of the format: smaller for Segment Anything, later for COCO, else error.
    #[default]
    Auto,
    /// The import fails and reports their number.
    Error,
    /// The mask with fewer pixels in this photo wins; between equals, the later one.
    Smaller,
    /// The later mask of the file wins; of black and white pictures, that with the larger id.
    Later,
}

/// What makes two masks of one object each one object.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "kebab-case")]
pub enum ObjectPer {
    /// Track, if every mask has one; else name, if every mask has one and no photo has two of one name; else mask.
    #[default]
    Auto,
    /// Masks with one track are one object in all photos.
    Track,
    /// Masks with one name are one object in all photos.
    Name,
    /// Each mask is an object of its own, and the ids of each photo are its own.
    Mask,
}

/// The options of an import.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ImportOptions {
    /// Folder with the masks, or a JSON of COCO.
    pub folder: PathBuf,
    /// Format of the folder.
    pub format: Format,
    /// The `pred.json` of DEVA; `None` looks for one beside the masks.
    pub pred: Option<PathBuf>,
    /// Rule for shared pixels.
    pub overlap: Overlap,
    /// Rule for objects, where masks show one object each.
    pub object_per: ObjectPer,
}
