//! What `labelgs eval` can be told.

use crate::cli::args::SceneArgs;
use crate::cli::labelled::MinConfidenceArg;
use crate::cli::values::{colour, near};
use crate::edit::select::MIN_LABEL_CONFIDENCE;
use crate::eval::protocol::{By, Protocol};
use clap::Args;
use std::path::{Path, PathBuf};

/// `labelgs eval`.
#[derive(Args, Clone, Debug)]
pub struct EvalArgs {
    /// The model: a PLY, or the folder that `labelgs train` made.
    #[arg(value_name = "MODEL")]
    pub model: PathBuf,
    /// Scene with the true pictures.
    #[arg(long, value_name = "SCENE")]
    pub scene: PathBuf,
    /// Which views: test, train, all, or names with commas between.
    #[arg(long, value_name = "VIEWS", default_value = "test")]
    pub views: String,
    /// Folder of id masks; objects are scored only with it.
    #[arg(long, value_name = "DIR")]
    pub masks: Option<PathBuf>,
    /// Folder of whole outlines, ID/NAME.png; otherwise SCENE/amodal if it is there.
    #[arg(long, value_name = "DIR", help_heading = "Labels")]
    pub amodal: Option<PathBuf>,
    /// Colour behind the scene: black, white, or R,G,B from 0 to 1.
    #[arg(long, value_name = "COLOUR", value_parser = colour, default_value = "black", help_heading = "Rendering")]
    pub background: [f32; 3],
    /// Gaussians nearer to the camera are not drawn, world units; otherwise as in the run of the model, otherwise 0.2.
    #[arg(long, value_name = "Z", value_parser = near, help_heading = "Rendering")]
    pub near: Option<f32>,
    /// Which Gaussians an object rendered alone is made of.
    #[command(flatten)]
    pub sure: MinConfidenceArg,
    /// Score by a published benchmark instead: its masks, its way of choosing objects, its averages.
    #[arg(
        long, value_name = "NAME", value_enum, requires = "truth", help_heading = "Benchmarks",
        conflicts_with_all = ["masks", "amodal", "views", "background"]
    )]
    pub protocol: Option<Protocol>,
    /// Folder with the benchmark's masks of this scene.
    #[arg(long, value_name = "DIR", requires = "protocol", help_heading = "Benchmarks")]
    pub truth: Option<PathBuf>,
    /// How objects are chosen; otherwise as the benchmark says: by name for lerf-mask and 3d-ovs.
    #[arg(long, value_name = "HOW", value_enum, requires = "protocol", help_heading = "Benchmarks")]
    pub by: Option<By>,
    /// Names of labels; otherwise labels.json of the model.
    #[arg(long, value_name = "labels.json", requires = "protocol", help_heading = "Benchmarks")]
    pub names: Option<PathBuf>,
    /// Only these objects, names with commas between.
    #[arg(long, value_name = "NAMES", requires = "protocol", value_delimiter = ',', help_heading = "Benchmarks")]
    pub objects: Vec<String>,
    /// Follow the published scorer, with its mistakes, as far as it is known: for labelgs and lerf-mask.
    #[arg(long, requires = "protocol", help_heading = "Benchmarks")]
    pub compat: bool,
    /// Weights of LPIPS v0.1 with VGG16, safetensors; without them there is no LPIPS.
    #[arg(long, value_name = "WEIGHTS", requires = "protocol", help_heading = "Benchmarks")]
    pub lpips: Option<PathBuf>,
    /// Write truth, prediction and difference of every picture as a web page into a new folder.
    #[arg(long, value_name = "DIR", help_heading = "Output")]
    pub page: Option<PathBuf>,
    /// Fail with status 1 if the mean PSNR is lower, dB.
    #[arg(long, value_name = "DB", help_heading = "Checks")]
    pub min_psnr: Option<f64>,
    /// Fail with status 1 if the mean IoU of the label maps, or the benchmark's, is lower.
    #[arg(long, value_name = "IOU", help_heading = "Checks")]
    pub min_iou: Option<f64>,
    /// How the scene is read.
    #[command(flatten)]
    pub reading: SceneArgs,
    /// Write all scores as JSON to FILE; without FILE print them.
    #[arg(id = "json_file", long = "json", value_name = "FILE", num_args = 0..=1, help_heading = "Output")]
    pub json: Option<Option<PathBuf>>,
}

impl EvalArgs {
    /// What is asked for where nobody types more than a model and a scene.
    pub fn new(model: &Path, scene: &Path) -> Self {
        Self {
            model: model.to_owned(),
            scene: scene.to_owned(),
            views: "test".to_owned(),
            masks: None,
            amodal: None,
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
            reading: SceneArgs::default(),
            json: None,
        }
    }
}
