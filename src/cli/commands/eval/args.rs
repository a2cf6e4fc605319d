//! Arguments of `labelgs eval`.

use crate::cli::support::parsers::colour;
use crate::cli::support::{SceneArgs, ScoreArgs};
use clap::Args;
use std::path::PathBuf;

/// `labelgs eval`.
#[derive(Args, Clone, Debug)]
pub struct EvalArgs {
    /// Model: a PLY, SPZ, GLB, SOG, USD or .splat file, or the output folder of `labelgs train`.
    #[arg(value_name = "MODEL")]
    pub model: PathBuf,
    /// Scene with the photos and cameras.
    #[arg(long, value_name = "SCENE")]
    pub scene: PathBuf,
    /// Views: test, train, all, or comma-separated names.
    #[arg(long, value_name = "VIEWS", default_value = "test")]
    pub views: String,
    /// Folder of id masks, to score objects.
    #[arg(long, value_name = "DIR")]
    pub masks: Option<PathBuf>,
    /// Folder of whole outlines, including occluded parts, ID/NAME.png. Default: SCENE/amodal, if it exists.
    #[arg(long, value_name = "DIR", help_heading = "Labels")]
    pub amodal: Option<PathBuf>,
    /// Also remove each object and score the remaining scene: as `remove`, as `remove --fill`, and by the paper's rule.
    /// Ground truth without the object is SCENE/without/ID/NAME.png, or SCENE/shadowed/ID/NAME.png if its shadow
    /// remains. Without ground truth, only the remaining weight of the object is reported.
    #[arg(long, requires = "masks", help_heading = "Labels")]
    pub removal: bool,
    /// Align the pose of each view with the model before scoring. Use it for models trained with --refine-poses,
    /// because held-out views keep their original poses.
    #[arg(long, help_heading = "Rendering")]
    pub refine_poses: bool,
    /// Colour behind the scene: a name such as white, #rrggbb, or R,G,B from 0 to 1.
    #[arg(long, value_name = "COLOUR", value_parser = colour, default_value = "black", help_heading = "Rendering")]
    pub background: [f32; 3],
    /// Label a pixel by its single heaviest Gaussian, as the LabelGS paper, instead of by the label with the largest
    /// total weight.
    #[arg(long, help_heading = "Labels")]
    pub compat: bool,
    #[command(flatten)]
    pub scoring: ScoreArgs,
    #[command(flatten)]
    pub reading: SceneArgs,
}
