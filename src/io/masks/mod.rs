//! Folders of masks: what trackers and data sets write, made into our own form, and what is wrong with a folder.
//!
//! Our own form is one grey PNG per photo, named like the photo, whose value is the id, with a `labels.json`
//! ([`super::label_table`]). [`import`] makes it from what [`Format`] lists; [`inspect`] reports on it.

pub(crate) mod check;
mod content;
mod detect;
mod folder;
mod import;
mod inspect;
mod pred;

pub use check::{Finding, Problem};
pub use import::{Imported, Overlaps, import};
pub use inspect::{Report, inspect};

use serde::Serialize;
use std::path::PathBuf;

/// How a folder of masks is to be read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "kebab-case")]
pub enum Format {
    /// What fits, if only one reading does.
    #[default]
    Auto,
    /// DEVA with --use_short_id: 8-bit grey, the value is the id.
    DevaShort,
    /// DEVA as it is: RGB, the id is R + 256 G + 65536 B.
    DevaLong,
    /// Palette pictures as of DAVIS: the index is the id.
    Palette,
    /// 16-bit grey, the value is the id.
    Grey16,
    /// A folder per object with a black and white picture per photo: OBJECT/NAME.png.
    BinaryFolders,
    /// A folder per photo with a black and white picture per object: NAME/OBJECT.png.
    PhotoFolders,
    /// `object_mask` of Gaussian Grouping: 8-bit grey, the value is the id.
    ObjectMask,
    /// `test_mask` of LERF-Mask: NAME/OBJECT.png.
    LerfMask,
    /// `segmentations` of 3D-OVS: NAME/OBJECT.png and classes.txt.
    #[serde(rename = "3d-ovs")]
    #[cfg_attr(feature = "cli", value(name = "3d-ovs"))]
    ThreeDOvs,
}

impl Format {
    /// Its name in settings and messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::DevaShort => "deva-short",
            Self::DevaLong => "deva-long",
            Self::Palette => "palette",
            Self::Grey16 => "grey16",
            Self::BinaryFolders => "binary-folders",
            Self::PhotoFolders => "photo-folders",
            Self::ObjectMask => "object-mask",
            Self::LerfMask => "lerf-mask",
            Self::ThreeDOvs => "3d-ovs",
        }
    }
}

/// Whose a pixel is that two black and white masks of a photo claim.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "kebab-case")]
pub enum Overlap {
    /// Nobody's: the import fails and tells how many there are.
    #[default]
    Error,
    /// The object's with fewer pixels in this photo; the larger id's between equals.
    Smaller,
    /// The object's with the larger id.
    Later,
}

/// What to import.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ImportOptions {
    /// Folder with the masks.
    pub folder: PathBuf,
    /// How to read it.
    pub format: Format,
    /// The `pred.json` of DEVA; otherwise that beside the masks, if there is one.
    pub pred: Option<PathBuf>,
    /// Whose shared pixels are.
    pub overlap: Overlap,
}

/// The first names of many, for messages.
fn shortened(names: &[impl AsRef<str>]) -> String {
    let shown = names.iter().take(5).map(AsRef::as_ref).collect::<Vec<&str>>().join(", ");
    if names.len() > 5 { format!("{shown}, ...") } else { shown }
}
