//! Mask folders: [`import`] converts the formats of trackers, segmenters, annotation tools and data sets; [`inspect`]
//! checks a folder.
//!
//! The format of labelgs is a grey PNG per photo, with the photo's name and ids as pixel values, and a `labels.json`
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
pub use import::{ImportSummary, Objects, Overlaps, import};
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

/// The format of a mask folder.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "kebab-case")]
pub enum Format {
    /// Detect the format; an error if several match.
    #[default]
    Auto,
    /// DEVA with --use_short_id: 8-bit grey, value = id.
    DevaShort,
    /// DEVA with default settings: RGB, id = R + 256 G + 65536 B.
    DevaLong,
    /// Palette images as in DAVIS: index = id.
    Palette,
    /// 16-bit grey, value = id.
    Grey16,
    /// One black and white image per photo, for a single object: NAME.png.
    Binary,
    /// One folder per object, one black and white image per photo: OBJECT/NAME.png.
    BinaryFolders,
    /// One folder per photo, one black and white image per object: NAME/OBJECT.png.
    PhotoFolders,
    /// `object_mask` of Gaussian Grouping: 8-bit grey, value = id.
    ObjectMask,
    /// `test_mask` of LERF-Mask: NAME/OBJECT.png.
    LerfMask,
    /// `segmentations` of 3D-OVS: NAME/OBJECT.png and classes.txt.
    #[serde(rename = "3d-ovs")]
    #[cfg_attr(feature = "cli", value(name = "3d-ovs"))]
    ThreeDOvs,
    /// COCO instances as JSON, as also exported by CVAT and Label Studio.
    Coco,
    /// Folders from Segment Anything's amg.py: NAME/0.png and NAME/metadata.csv.
    SamFolders,
    /// Run-length JSON from Segment Anything's amg.py: NAME.json.
    SamJson,
}

impl Format {
    /// Returns the name in settings and messages.
    pub fn name(self) -> String {
        name_of(&self)
    }
}

/// How to resolve pixels that two masks of a photo share. COCO crowds yield to all others.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "kebab-case")]
pub enum Overlap {
    /// Choose by format: smaller for Segment Anything, later for COCO, else error.
    #[default]
    Auto,
    /// Fail, and report how many pixels overlap.
    Error,
    /// The smaller mask in the photo wins; of equal masks, the later one wins.
    Smaller,
    /// The later mask in the file wins; of black and white images, the mask with the larger id wins.
    Later,
}

/// How masks of single objects are grouped into objects.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "kebab-case")]
pub enum ObjectPer {
    /// Use track if every mask has a track id, else name if every mask has a name that is unique in its photo, else
    /// mask.
    #[default]
    Auto,
    /// Masks with the same track id are one object in all photos.
    Track,
    /// Masks with the same name are one object in all photos.
    Name,
    /// Every mask is a separate object; ids do not match between photos.
    Mask,
}

/// The options of an import.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ImportOptions {
    /// Folder with the masks, or a COCO JSON file.
    pub folder: PathBuf,
    /// Format of the folder.
    pub format: Format,
    /// DEVA's `pred.json`; `None` looks for one beside the masks.
    pub pred: Option<PathBuf>,
    /// Rule for shared pixels.
    pub overlap: Overlap,
    /// Rule for objects, if masks show single objects.
    pub object_per: ObjectPer,
}
