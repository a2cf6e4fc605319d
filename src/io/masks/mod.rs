//! Folders of masks: [`import`] converts the formats of trackers and data sets, [`inspect`] checks a folder.
//!
//! Our own format is one grey PNG per photo with the photo's name, whose pixel value is the id, and a `labels.json`
//! ([`LabelTable`](super::LabelTable)).

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
}

impl Format {
    /// Returns the name in settings and messages.
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

/// The rule for pixels that two black and white masks of a photo share.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "kebab-case")]
pub enum Overlap {
    /// The import fails and reports their number.
    #[default]
    Error,
    /// The object with fewer pixels in this photo wins; between equals, the larger id.
    Smaller,
    /// The object with the larger id wins.
    Later,
}

/// The options of an import.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ImportOptions {
    /// Folder with the masks.
    pub folder: PathBuf,
    /// Format of the folder.
    pub format: Format,
    /// The `pred.json` of DEVA; `None` looks for one beside the masks.
    pub pred: Option<PathBuf>,
    /// Rule for shared pixels.
    pub overlap: Overlap,
}

/// Returns the first few names, for messages.
fn shortened(names: &[impl AsRef<str>]) -> String {
    let shown = names.iter().take(5).map(AsRef::as_ref).collect::<Vec<&str>>().join(", ");
    if names.len() > 5 { format!("{shown}, ...") } else { shown }
}
