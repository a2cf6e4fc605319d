//! Published benchmarks of object masks: where their files are, how labels are chosen, what is averaged.
//!
//! A file per benchmark turns the list of true masks into a [`Layout`]: objects, the frames in which they are scored, and
//! how each is chosen. [`run`] chooses and scores, [`report`] averages. Nothing is left out in silence: an object that
//! cannot be chosen and a frame that cannot be rendered count as 0 and are listed.

pub(crate) mod bench;
mod binary;
mod labelgs;
mod lerf_mask;
mod nvos;
pub(crate) mod paint;
pub(crate) mod report;
pub(crate) mod run;
pub(crate) mod score;
mod select;

pub use bench::Bench;
pub use paint::{EnginePainter, Painter};
pub use report::Report;
pub use run::run;
mod three_d_ovs;

use crate::error::{Error, Result};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A benchmark.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum Protocol {
    /// The LabelGS paper: TRUTH/FRAME/OBJECT.png; the first frame is the prompt.
    Labelgs,
    /// LERF-Mask of Gaussian Grouping: TRUTH/FRAME/PROMPT.png; objects by name.
    LerfMask,
    /// 3D-OVS: TRUTH/FRAME/CLASS.png and TRUTH/classes.txt; objects by name.
    #[cfg_attr(feature = "cli", value(name = "3d-ovs"))]
    ThreeDOvs,
    /// NVOS: masks, reference_image and scribbles, each with a folder per scene.
    Nvos,
    /// TRUTH/FRAME.png or TRUTH/OBJECT/FRAME.png; the first frame is the prompt, as in SPIn-NeRF.
    Binary,
}

/// How labels are chosen for an object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum By {
    /// By a mask in one view: labels with more than half of their pixels under it.
    Prompt,
    /// By the object's name in labels.json.
    Name,
}

/// A true mask.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Truth {
    /// Name of the frame, without extension.
    pub frame: String,
    /// File, relative to the folder of the truth.
    pub file: PathBuf,
}

/// What an object is chosen by.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Prompt {
    /// A mask in one frame.
    Mask(Truth),
    /// Strokes on the object and beside it, in one frame.
    Scribbles {
        /// Name of the frame, without extension.
        frame: String,
        /// Strokes on the object.
        on: Vec<PathBuf>,
        /// Strokes elsewhere.
        off: Vec<PathBuf>,
    },
    /// Its name.
    Name,
}

/// An object and its true masks.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Task {
    /// Name of the object.
    pub object: String,
    /// What it is chosen by.
    pub prompt: Prompt,
    /// The masks it is scored by, sorted by frame.
    pub truths: Vec<Truth>,
}

/// What a benchmark asks for.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Layout {
    /// Objects, sorted by name.
    pub tasks: Vec<Task>,
    /// Masks that the rules leave out, and why.
    pub left_out: Vec<String>,
}

/// What decides about a layout besides the files.
#[derive(Clone, Copy, Debug)]
pub struct Ask<'a> {
    /// Folder of the truth, after [`Protocol::root`].
    pub truth: &'a Path,
    /// Name of the scene's folder.
    pub scene: &'a str,
    /// How objects are chosen.
    pub by: By,
}

impl Protocol {
    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Labelgs => "labelgs",
            Self::LerfMask => "lerf-mask",
            Self::ThreeDOvs => "3d-ovs",
            Self::Nvos => "nvos",
            Self::Binary => "binary",
        }
    }

    /// Where the masks are below a folder that a person names: there, or where the data set keeps them.
    pub fn root(self, folder: &Path) -> PathBuf {
        let inside = match self {
            Self::Labelgs | Self::ThreeDOvs => "segmentations",
            Self::LerfMask => "test_mask",
            Self::Nvos => "labels/llff",
            Self::Binary => return folder.to_owned(),
        };
        Some(folder.join(inside)).filter(|folder| folder.is_dir()).unwrap_or_else(|| folder.to_owned())
    }

    /// How this benchmark chooses objects.
    pub fn chooses_by(self) -> By {
        match self {
            Self::Labelgs | Self::Nvos | Self::Binary => By::Prompt,
            Self::LerfMask | Self::ThreeDOvs => By::Name,
        }
    }

    /// True if a published scorer is known that `--compat` can follow.
    pub fn has_scorer(self) -> bool {
        matches!(self, Self::Labelgs | Self::LerfMask)
    }

    /// True if masks may lie in folders that are numbers of test views instead of names.
    pub fn numbers_views(self) -> bool {
        self == Self::LerfMask
    }

    /// Sorts `files` (relative to the truth; and the words of classes.txt, where there is one) into objects.
    pub fn layout(self, files: &[PathBuf], classes: Option<&str>, ask: Ask) -> Result<Layout> {
        let layout = match self {
            Self::Labelgs => labelgs::layout(files, ask),
            Self::LerfMask => lerf_mask::layout(files, ask),
            Self::ThreeDOvs => three_d_ovs::layout(files, classes, ask),
            Self::Nvos => nvos::layout(files, ask),
            Self::Binary => binary::layout(files, ask),
        };
        let layout = layout.map_err(|problem| Error::data(ask.truth, "", problem))?;
        if layout.tasks.iter().all(|task| task.truths.is_empty()) {
            let problem = "leaves no mask to score: the first frame is the prompt, and no other shows the same object";
            return Err(Error::data(ask.truth, "", problem));
        }
        Ok(layout)
    }
}

/// File name without extension.
fn stem(path: &Path) -> String {
    path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default()
}

/// True for the files that can be masks: compression of a JPEG moves edges.
fn is_png(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("png"))
}

/// The names of the folders that a file lies in, outermost first.
fn folders(path: &Path) -> Vec<String> {
    let parent = path.parent().unwrap_or(Path::new(""));
    parent.components().map(|part| part.as_os_str().to_string_lossy().into_owned()).collect()
}

/// Objects, each with its masks, of files FRAME/OBJECT.png; files elsewhere are left out.
fn by_frame_and_object(files: &[PathBuf], left_out: &mut Vec<String>) -> BTreeMap<String, Vec<Truth>> {
    let mut objects: BTreeMap<String, Vec<Truth>> = BTreeMap::new();
    for file in files.iter().filter(|file| is_png(file)) {
        match &folders(file)[..] {
            [frame] => {
                objects.entry(stem(file)).or_default().push(Truth { frame: frame.clone(), file: file.clone() });
            }
            _ => left_out.push(format!("{} is no FRAME/OBJECT.png", file.display())),
        }
    }
    objects
}

/// One task per object: by name and in all frames, or by the mask in the first of all frames and in the others. Objects
/// that the first frame does not show cannot be chosen by it and are left out.
fn tasks(objects: BTreeMap<String, Vec<Truth>>, ask: Ask) -> Layout {
    let first = objects.values().flatten().map(|truth| truth.frame.clone()).min().unwrap_or_default();
    let mut layout = Layout::default();
    for (object, mut truths) in objects {
        truths.sort_by(|a, b| a.frame.cmp(&b.frame));
        if ask.by == By::Name {
            layout.tasks.push(Task { object, prompt: Prompt::Name, truths });
            continue;
        }
        match truths.iter().position(|truth| truth.frame == first) {
            Some(at) => {
                let prompt = truths.remove(at);
                layout.tasks.push(Task { object, prompt: Prompt::Mask(prompt), truths });
            }
            None => layout.left_out.push(format!("{object} is not in the prompt's frame {first}")),
        }
    }
    layout
}
