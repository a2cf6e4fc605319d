//! Arguments of `labelgs eval`.

use crate::cli::support::parsers::colour;
use crate::cli::support::{SceneArgs, ScoreArgs};
use clap::Args;
use std::path::PathBuf;

/// `labelgs eval`.
#[derive(Args, Clone, Debug)]
pub struct EvalArgs {
    /// The model: a PLY, SPZ, GLB, SOG, USD or .splat, or the folder of a `labelgs train` run.
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
    /// The label of a pixel is that of its Gaussian with the largest weight, as in the LabelGS paper, instead of the
    /// label with the largest sum of weights.
    #[arg(long, help_heading = "Labels")]
    pub compat: bool,
    #[command(flatten)]
    pub scoring: ScoreArgs,
    #[command(flatten)]
    pub reading: SceneArgs,
}
