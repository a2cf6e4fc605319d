//! Arguments of `labelgs eval`.

use crate::cli::args::SceneArgs;
use crate::cli::drawer::MemoryArg;
use crate::cli::labelled::MinConfidenceArg;
use crate::cli::values::{colour, near};
use crate::edit::select::MIN_LABEL_CONFIDENCE;
use crate::eval::protocol::{By, Protocol};
use clap::Args;
use std::path::{Path, PathBuf};

/// `labelgs eval`.
#[derive(Args, Clone, Debug)]
pub struct EvalArgs {
    /// The model: a PLY, SPZ, GLB, SOG or .splat, or the folder of a `labelgs train` run.
    #[arg(value_name = "MODEL")]
    pub model: PathBuf,
    /// Scene with the photos to compare with.
    #[arg(long, value_name = "SCENE")]
    pub scene: PathBuf,
    /// Which views: test, train, all, or names with commas between.
    #[arg(long, value_name = "VIEWS", default_value = "test")]
    pub views: String,
    /// Folder of id masks. Objects are scored only with masks.
    #[arg(long, value_name = "DIR")]
    pub masks: Option<PathBuf>,
    /// Folder of outlines of whole objects, ID/NAME.png. Default: SCENE/amodal, if it exists.
    #[arg(long, value_name = "DIR", help_heading = "Labels")]
    pub amodal: Option<PathBuf>,
    /// Also remove each object and score what is left: by the labels of the model, the same with `remove --fill`, and by the
    /// paper's rule. Photos without an object are SCENE/without/ID/NAME.png, those with its shadow
    /// SCENE/shadowed/ID/NAME.png; without any, only the weight of Gaussians that stay is given.
    #[arg(long, requires = "masks", help_heading = "Labels")]
    pub removal: bool,
    /// Refine the pose of each view by the model before it is scored, for models of --refine-poses: they bend with their
    /// photos, and held-out views keep the poses of the reconstruction.
    #[arg(long, help_heading = "Rendering")]
    pub refine_poses: bool,
    /// Colour behind the scene: a name such as white, #rrggbb, or R,G,B from 0 to 1.
    #[arg(long, value_name = "COLOUR", value_parser = colour, default_value = "black", help_heading = "Rendering")]
    pub background: [f32; 3],
    /// Near plane, world units: nearer Gaussians are not drawn. Default: the value of the model's run, else 0.2. Other
    /// viewers often draw from 0.01 on; a worse score there shows Gaussians before the cameras that fog the pictures.
    #[arg(long, value_name = "Z", value_parser = near, help_heading = "Rendering")]
    pub near: Option<f32>,
    /// Gaussians of an object that is rendered alone.
    #[command(flatten)]
    pub sure: MinConfidenceArg,
    /// Score by a published benchmark instead, with its masks, its choice of objects and its averages.
    #[arg(
        long, value_name = "NAME", value_enum, requires = "truth", help_heading = "Benchmarks",
        conflicts_with_all = ["masks", "amodal", "removal", "refine_poses", "views", "background"]
    )]
    pub protocol: Option<Protocol>,
    /// Folder with the benchmark's masks of this scene.
    #[arg(long, value_name = "DIR", requires = "protocol", help_heading = "Benchmarks")]
    pub truth: Option<PathBuf>,
    /// How objects are chosen. Default: the rule of the benchmark, which is by name for lerf-mask and 3d-ovs.
    #[arg(long, value_name = "HOW", value_enum, requires = "protocol", help_heading = "Benchmarks")]
    pub by: Option<By>,
    /// Table with the names of labels. Default: labels.json of the model.
    #[arg(long, value_name = "labels.json", requires = "protocol", help_heading = "Benchmarks")]
    pub names: Option<PathBuf>,
    /// Score only these objects, names with commas between.
    #[arg(long, value_name = "NAMES", requires = "protocol", value_delimiter = ',', help_heading = "Benchmarks")]
    pub objects: Vec<String>,
    /// The label of a pixel is that of its Gaussian with the largest weight, as in the LabelGS paper, instead of the
    /// label with the largest sum of weights. With --protocol, follow the published scorer, mistakes included; only for
    /// labelgs and lerf-mask.
    #[arg(long, help_heading = "Benchmarks")]
    pub compat: bool,
    /// Weights of LPIPS v0.1 with VGG16, safetensors (guide, page benchmarks): adds the LPIPS of each view, or with
    /// --protocol of each object. It takes seconds to minutes for a view.
    #[arg(long, value_name = "WEIGHTS", help_heading = "Scores")]
    pub lpips: Option<PathBuf>,
    /// New folder for a web page with ground truth, prediction and difference of every picture.
    #[arg(long, value_name = "DIR", help_heading = "Output")]
    pub page: Option<PathBuf>,
    /// Least mean PSNR, dB. Exit status 1 if it is lower.
    #[arg(long, value_name = "DB", help_heading = "Checks")]
    pub min_psnr: Option<f64>,
    /// Least mean IoU of the label maps, or of the benchmark. Exit status 1 if it is lower.
    #[arg(long, value_name = "IOU", help_heading = "Checks")]
    pub min_iou: Option<f64>,
    /// Memory.
    #[command(flatten)]
    pub memory: MemoryArg,
    /// How the scene is read.
    #[command(flatten)]
    pub reading: SceneArgs,
    /// Write all scores as JSON to FILE, or to standard output without FILE.
    #[arg(id = "json_file", long = "json", value_name = "FILE", num_args = 0..=1, help_heading = "Output")]
    pub json: Option<Option<PathBuf>>,
}

impl EvalArgs {
    /// Returns the arguments of a command with a model, a scene and no flags.
    pub fn new(model: &Path, scene: &Path) -> Self {
        Self {
            model: model.to_owned(),
            scene: scene.to_owned(),
            views: "test".to_owned(),
            masks: None,
            amodal: None,
            removal: false,
            refine_poses: false,
            background: [0.0; 3],
            near: None,
            sure: MinConfidenceArg { min_confidence: MIN_LABEL_CONFIDENCE },
            protocol: None,
            truth: None,
            by: None,
            names: None,
            objects: Vec::new(),
            compat: false,
            lpips: None,
            page: None,
            min_psnr: None,
            min_iou: None,
            memory: MemoryArg::default(),
            reading: SceneArgs::default(),
            json: None,
        }
    }
}
