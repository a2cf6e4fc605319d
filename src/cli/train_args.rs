//! Flags of `labelgs train`: one per field of [`TrainConfig`], each absent unless typed. Defaults in the help come from
//! `TrainConfig::default()`.

use super::args::{JsonFlag, ReadArgs};
use super::values::{bytes, colour, count, samples, switch};
use crate::scene::DepthKind;
use crate::train::TrainConfig;
use crate::train::config::{LabelRule, Occlusion};
use clap::Args;
use std::path::PathBuf;

/// `labelgs train`.
#[derive(Args, Clone, Debug)]
pub struct TrainArgs {
    /// Folder of the scene (COLMAP or transforms.json), or one .json file.
    #[arg(value_name = "SCENE")]
    pub scene: PathBuf,
    /// Folder for the model, the configuration and the records of the run.
    #[arg(short, long, value_name = "OUT")]
    pub output: PathBuf,
    /// Folder of id masks, one per view by name; without it the model has no labels.
    #[arg(long, value_name = "DIR")]
    pub masks: Option<PathBuf>,
    /// Folder of depth maps for --occlusion depth, one per photo by name: 16-bit PNG, EXR, NPY or PFM.
    #[arg(long, value_name = "DIR", requires = "depth_kind", requires = "masks")]
    pub depths: Option<PathBuf>,
    /// What the numbers of --depths mean.
    #[arg(long, value_name = "KIND", value_enum, requires = "depths")]
    pub depth_kind: Option<DepthKind>,
    /// Occluders to use, as `labelgs occlusion` and an earlier run write them.
    #[arg(long, value_name = "FILE", requires = "masks", conflicts_with_all = ["occlusion", "depths"])]
    pub occlusion_file: Option<PathBuf>,
    /// Settings in TOML, as config.toml of an earlier run; flags win over it.
    #[arg(long, value_name = "FILE.toml")]
    pub config: Option<PathBuf>,
    /// Go on from the newest checkpoint in OUT, with its settings and masks; without one, start at step 1.
    #[arg(long)]
    pub resume: bool,
    /// Open the device again if it is lost, and go on from the newest checkpoint, as long as there is a new one each
    /// time. The pass that lost it is named, at some cost in time.
    #[arg(long)]
    pub restart: bool,
    /// JSON.
    #[command(flatten)]
    pub json: JsonFlag,

    /// Most memory of the device to use, such as 1500M or 2G: the number of Gaussians stays below what that holds.
    #[arg(long, value_name = "SIZE", value_parser = bytes)]
    pub memory_limit: Option<u64>,
    /// What is let through of the scene; the same has to be typed again with --resume.
    #[command(flatten)]
    pub read: ReadArgs,
    /// The run.
    #[command(flatten)]
    pub run: RunFlags,
    /// Labels.
    #[command(flatten)]
    pub label: LabelFlags,
    /// Loss and rates.
    #[command(flatten)]
    pub optimiser: OptimiserFlags,
    /// Densification.
    #[command(flatten)]
    pub density: DensityFlags,
}

/// The run as a whole.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Run")]
pub struct RunFlags {
    /// Start from the settings of the LabelGS paper, where ours differ: --label-rule main --label-weight 1
    /// --densify-until 40000 --opacity-reset-interval 3000.
    #[arg(long, conflicts_with = "config")]
    pub paper: bool,
    /// Number of steps, one view each.
    #[arg(long, value_name = "N")]
    pub iterations: Option<u32>,
    /// Longest side of a photo, px; 0 keeps its size.
    #[arg(long, value_name = "PX")]
    pub max_resolution: Option<u32>,
    /// Last step that looks at photos of half the size, without labels; 0 for none.
    #[arg(long, value_name = "STEP")]
    pub coarse_until: Option<u32>,
    /// Every N-th view by name is held out.
    #[arg(long, value_name = "N", conflicts_with = "no_test")]
    pub test_every: Option<u32>,
    /// Hold out nothing.
    #[arg(long)]
    pub no_test: bool,
    /// Seed of every random number; the same seed, device and driver give the same model.
    #[arg(long, value_name = "S")]
    pub seed: Option<u64>,
    /// Most Gaussians, such as 500k or 2M; 0 lets the memory of the device decide.
    #[arg(long, value_name = "N", value_parser = count)]
    pub max_gaussians: Option<u64>,
    /// Colour behind the scene: black, white, or R,G,B from 0 to 1.
    #[arg(long, value_name = "COLOUR", value_parser = colour)]
    pub background: Option<[f32; 3]>,
    /// Gaussians nearer to the camera are not drawn, world units.
    #[arg(long, value_name = "Z")]
    pub near: Option<f32>,
    /// Steps after which to save the model too, with commas between.
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    pub save_at: Option<Vec<u32>>,
    /// Steps between two preview pictures; 0 makes none.
    #[arg(long, value_name = "N")]
    pub preview_every: Option<u32>,
    /// Steps between two checkpoints; 0 writes one when interrupted only.
    #[arg(long, value_name = "N")]
    pub checkpoint_every: Option<u32>,
}

/// Object labels; they need masks.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Labels")]
pub struct LabelFlags {
    /// First step with labels.
    #[arg(long, value_name = "STEP")]
    pub label_from: Option<u32>,
    /// How a Gaussian gets its label.
    #[arg(long, value_name = "RULE", value_enum)]
    pub label_rule: Option<LabelRule>,
    /// Steps between two counts of votes.
    #[arg(long, value_name = "STEPS")]
    pub vote_every: Option<u32>,
    /// Less weight for masks that disagree with all others, on or off.
    #[arg(long, value_name = "SWITCH", value_parser = switch)]
    pub vote_trust: Option<bool>,
    /// Pixels so near to a contour of their mask are left out, px.
    #[arg(long, value_name = "PX")]
    pub mask_border: Option<u32>,
    /// Least blending weight at a pixel that gives its label to a Gaussian.
    #[arg(long, value_name = "WEIGHT")]
    pub label_threshold: Option<f32>,
    /// Gaussian projection filter, on or off: the centre must project into the mask too.
    #[arg(long, value_name = "SWITCH", value_parser = switch)]
    pub gpf: Option<bool>,
    /// Objects per step.
    #[arg(long, value_name = "N|all", value_parser = samples)]
    pub label_samples: Option<u32>,
    /// Weight of the label loss.
    #[arg(long, value_name = "WEIGHT")]
    pub label_weight: Option<f32>,
    /// Small objects weigh more per pixel than large ones, on or off.
    #[arg(long, value_name = "SWITCH", value_parser = switch)]
    pub label_balance: Option<bool>,
    /// Weight of the alpha term in the label loss.
    #[arg(long, value_name = "WEIGHT")]
    pub label_alpha: Option<f32>,
    /// Where occluders come from.
    #[arg(long, value_name = "SOURCE", value_enum)]
    pub occlusion: Option<Occlusion>,
    /// Steps between two looks at the occluders.
    #[arg(long, value_name = "STEPS")]
    pub occlusion_every: Option<u32>,
}

/// Loss, colours and learning rates.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Optimiser")]
pub struct OptimiserFlags {
    /// Share of D-SSIM in the photometric loss.
    #[arg(long, value_name = "SHARE")]
    pub lambda_dssim: Option<f32>,
    /// Degree of the spherical harmonics, 0 to 3.
    #[arg(long, value_name = "DEGREE")]
    pub sh_degree: Option<u32>,
    /// Steps until the next degree is let in.
    #[arg(long, value_name = "STEPS")]
    pub sh_degree_interval: Option<u32>,
    /// Rate of positions at the start, scene extents.
    #[arg(long, value_name = "RATE")]
    pub position_lr_init: Option<f64>,
    /// Rate of positions at the end, scene extents.
    #[arg(long, value_name = "RATE")]
    pub position_lr_final: Option<f64>,
    /// Step that has the final rate of positions.
    #[arg(long, value_name = "STEP")]
    pub position_lr_max_steps: Option<u32>,
    /// Rate of the degree-0 colour.
    #[arg(long, value_name = "RATE")]
    pub feature_lr: Option<f64>,
    /// Rate of the other colours.
    #[arg(long, value_name = "RATE")]
    pub feature_rest_lr: Option<f64>,
    /// Rate of opacity logits.
    #[arg(long, value_name = "RATE")]
    pub opacity_lr: Option<f64>,
    /// Rate of log-scales.
    #[arg(long, value_name = "RATE")]
    pub scaling_lr: Option<f64>,
    /// Rate of quaternions.
    #[arg(long, value_name = "RATE")]
    pub rotation_lr: Option<f64>,
}

/// Growth and pruning.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Densification")]
pub struct DensityFlags {
    /// Step after which it starts.
    #[arg(long, value_name = "STEP")]
    pub densify_from: Option<u32>,
    /// Step at which it ends, at the earliest 1000 steps after --densify-from if not given [default: half of the run].
    #[arg(long, value_name = "STEP")]
    pub densify_until: Option<u32>,
    /// Steps between two.
    #[arg(long, value_name = "STEPS")]
    pub densify_interval: Option<u32>,
    /// Mean screen gradient that clones or splits, half images.
    #[arg(long, value_name = "GRADIENT")]
    pub densify_grad_threshold: Option<f32>,
    /// Largest size that is cloned instead of split, scene extents.
    #[arg(long, value_name = "SIZE")]
    pub percent_dense: Option<f32>,
    /// Least opacity that is kept.
    #[arg(long, value_name = "OPACITY")]
    pub min_opacity: Option<f32>,
    /// Largest size that is kept, scene extents.
    #[arg(long, value_name = "SIZE")]
    pub max_scale: Option<f32>,
    /// Steps between two opacity resets; 0 makes none.
    #[arg(long, value_name = "STEPS")]
    pub opacity_reset_interval: Option<u32>,
    /// Steps before the end without an opacity reset.
    #[arg(long, value_name = "STEPS")]
    pub opacity_reset_margin: Option<u32>,
}

/// Copies the typed flags of one group into the configuration.
macro_rules! take {
    ($config:ident, $flags:expr, $($field:ident)*) => {
        $( if let Some(value) = $flags.$field.clone() { $config.$field = value; } )*
    };
}

impl TrainArgs {
    /// Puts what was typed over `config`.
    pub fn apply(&self, config: &mut TrainConfig) {
        take!(config, self.run, iterations max_resolution coarse_until test_every seed max_gaussians background near save_at
            preview_every checkpoint_every);
        if self.run.no_test {
            config.test_every = 0;
        }
        take!(config, self.label, label_from label_rule vote_every vote_trust mask_border
            label_threshold gpf label_samples label_weight label_balance
            label_alpha occlusion occlusion_every);
        if self.occlusion_file.is_some() {
            config.occlusion = Occlusion::File;
        }
        take!(config, self.optimiser, lambda_dssim sh_degree sh_degree_interval position_lr_init position_lr_final
            position_lr_max_steps feature_lr opacity_lr scaling_lr rotation_lr);
        config.feature_rest_lr = self.optimiser.feature_rest_lr.or(config.feature_rest_lr);
        config.densify_until = self.density.densify_until.or(config.densify_until);
        take!(config, self.density, densify_from densify_interval densify_grad_threshold percent_dense
            min_opacity max_scale opacity_reset_interval opacity_reset_margin);
    }
}
