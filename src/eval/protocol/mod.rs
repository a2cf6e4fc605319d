//! Published benchmarks of object masks.
//!
//! [`Protocol::layout`] sorts a benchmark's mask files into a [`Layout`]: objects, scored frames, and how to choose
//! each object's labels. `run` chooses labels and scores, `report` averages. An object without labels and a frame
//! without a prediction count as 0 and are listed.

pub(crate) mod bench;
mod binary;
mod by_frame;
mod nvos;
pub(crate) mod report;
pub(crate) mod run;
pub mod score;
mod select;

pub use bench::Bench;
pub use report::Report;
pub use run::run;

use crate::error::{Error, Result};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A benchmark.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum Protocol {
    /// LabelGS paper: TRUTH/FRAME/OBJECT.png; the first frame is the prompt.
    Labelgs,
    /// LERF-Mask of Gaussian Grouping: TRUTH/FRAME/PROMPT.png; objects are chosen by name.
    LerfMask,
    /// 3D-OVS: TRUTH/FRAME/CLASS.png and TRUTH/classes.txt; objects are chosen by name.
    #[cfg_attr(feature = "cli", value(name = "3d-ovs"))]
    ThreeDOvs,
    /// NVOS: folders masks, reference_image and scribbles, each with a subfolder per scene.
    Nvos,
    /// SPIn-NeRF and others: TRUTH/FRAME.png or TRUTH/OBJECT/FRAME.png; the first frame is the prompt.
    Binary,
}

/// How to choose the labels of an object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum SelectBy {
    /// Labels with more than half of their pixels inside a mask of one view.
    Prompt,
    /// The label that has the object's name in labels.json.
    Name,
}

/// A ground-truth mask.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TruthFile {
    /// Name of the frame, without extension.
    pub frame: String,
    /// File, relative to the folder of the ground truth.
    pub file: PathBuf,
}

/// The prompt of an object.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Prompt {
    /// A mask in one frame.
    Mask(TruthFile),
    /// Strokes on and off the object, in one frame.
    Scribbles {
        /// Name of the frame, without extension.
        frame: String,
        /// Strokes on the object.
        on: Vec<PathBuf>,
        /// Strokes off the object.
        off: Vec<PathBuf>,
    },
    /// The name of the object.
    Name,
}

/// An object and its ground-truth masks.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Task {
    /// Name of the object.
    pub object: String,
    /// Its prompt.
    pub prompt: Prompt,
    /// Masks to score against, sorted by frame.
    pub truths: Vec<TruthFile>,
}

/// The objects and masks of a benchmark.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Layout {
    /// Objects, sorted by name.
    pub tasks: Vec<Task>,
    /// Masks that the rules exclude, with reasons.
    pub left_out: Vec<String>,
}

/// Inputs of a layout besides the mask files.
#[derive(Clone, Copy, Debug)]
pub struct LayoutInput<'a> {
    /// Folder of the ground truth, from [`Protocol::root`].
    pub truth: &'a Path,
    /// Name of the scene's folder.
    pub scene: &'a str,
    /// How to choose labels.
    pub by: SelectBy,
}

impl Protocol {
    /// Returns the name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Labelgs => "labelgs",
            Self::LerfMask => "lerf-mask",
            Self::ThreeDOvs => "3d-ovs",
            Self::Nvos => "nvos",
            Self::Binary => "binary",
        }
    }

    /// Returns the mask folder: `folder`, or the data set's subfolder.
    pub fn root(self, folder: &Path) -> PathBuf {
        let inside = match self {
            Self::Labelgs | Self::ThreeDOvs => "segmentations",
            Self::LerfMask => "test_mask",
            Self::Nvos => "labels/llff",
            Self::Binary => return folder.to_owned(),
        };
        Some(folder.join(inside)).filter(|folder| folder.is_dir()).unwrap_or_else(|| folder.to_owned())
    }

    /// Returns how this benchmark chooses labels.
    pub fn chooses_by(self) -> SelectBy {
        match self {
            Self::Labelgs | Self::Nvos | Self::Binary => SelectBy::Prompt,
            Self::LerfMask | Self::ThreeDOvs => SelectBy::Name,
        }
    }

    /// Returns true if `--compat` can follow a published scorer.
    pub fn has_scorer(self) -> bool {
        matches!(self, Self::Labelgs | Self::LerfMask)
    }

    /// Returns true if mask folders may be named by the number of a held-out view.
    pub fn numbers_views(self) -> bool {
        self == Self::LerfMask
    }

    /// Sorts `files` (relative to the ground truth) into objects. `classes` is the content of classes.txt, if it
    /// exists.
    pub fn layout(self, files: &[PathBuf], classes: Option<&str>, ask: LayoutInput) -> Result<Layout> {
        let layout = match self {
            Self::Labelgs => by_frame::labelgs(files, ask),
            Self::LerfMask => by_frame::lerf_mask(files, ask),
            Self::ThreeDOvs => by_frame::three_d_ovs(files, classes, ask),
            Self::Nvos => nvos::layout(files, ask),
            Self::Binary => binary::layout(files, ask),
        };
        let layout = layout.map_err(|problem| Error::data(ask.truth, "", problem))?;
        if layout.tasks.iter().all(|task| task.truths.is_empty()) {
            let problem =
                "has no masks to score: the first frame is the prompt, and no other frame shows the same object";
            return Err(Error::data(ask.truth, "", problem));
        }
        Ok(layout)
    }
}

fn stem(path: &Path) -> String {
    path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default()
}

/// Returns true for PNG files. JPEG is not accepted, because its compression shifts mask edges.
fn is_png(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("png"))
}

/// Returns the folder names of a path, outermost first.
fn folders(path: &Path) -> Vec<String> {
    let parent = path.parent().unwrap_or(Path::new(""));
    parent.components().map(|part| part.as_os_str().to_string_lossy().into_owned()).collect()
}

/// Makes one task per object: by name in all frames, or by the mask of the first frame in all other frames. Without a
/// mask in the first frame, an object has no prompt and is excluded.
fn tasks(objects: BTreeMap<String, Vec<TruthFile>>, left_out: Vec<String>, ask: LayoutInput) -> Layout {
    let first = objects.values().flatten().map(|truth| truth.frame.clone()).min().unwrap_or_default();
    let mut layout = Layout::default();
    for (object, mut truths) in objects {
        truths.sort_by(|a, b| a.frame.cmp(&b.frame));
        if ask.by == SelectBy::Name {
            layout.tasks.push(Task { object, prompt: Prompt::Name, truths });
            continue;
        }
        match truths.iter().position(|truth| truth.frame == first) {
            Some(at) => {
                let prompt = truths.remove(at);
                layout.tasks.push(Task { object, prompt: Prompt::Mask(prompt), truths });
            }
            None => layout.left_out.push(format!("{object} is not in the prompt frame {first}")),
        }
    }
    layout.left_out.extend(left_out);
    layout
}
