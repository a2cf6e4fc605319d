//! What can be typed. Only what was typed is in here; decisions are made in `config` and in the verbs.

use super::choose::PromptArgs;
use super::densify::DensifyArgs;
use super::eval::EvalArgs;
use super::labelled::{SureArg, TableArg};
use super::masks::MasksArgs;
use super::merge::MergeArgs;
use super::occlusion::OcclusionArgs;
use super::recolour::RecolourArgs;
use super::relabel::RelabelArgs;
use super::select::{ExtractArgs, SelectArgs};
use super::split_components::SplitArgs;
use super::train_args::TrainArgs;
use super::values::{Picks, Size, colour, count, picks, share, size};
use crate::infer::output::{Format, What};
use crate::synth::Preset;
use clap::{Args, Parser, Subcommand};
use std::path::PathBuf;

const EXIT_STATUSES: &str = "\
Exit status: 0 done, 1 finished but a requested check failed, 2 usage, 3 bad input, 4 no usable device, 5 out of memory, \
6 device lost, 7 output, 8 numerical failure, 70 a bug, 130 or 143 interrupted.
Results go to standard output, everything else to standard error.";

/// Label-aware 3D Gaussian Splatting on Vulkan compute: train, list, extract, remove, render and score objects.
#[derive(Debug, Parser)]
#[command(name = "labelgs", version, after_help = EXIT_STATUSES, propagate_version = true)]
pub struct Cli {
    /// Print results as JSON.
    #[arg(long)]
    pub json: bool,
    /// What applies to every verb.
    #[command(flatten)]
    pub global: GlobalArgs,
    /// The verb.
    #[command(subcommand)]
    pub command: Command,
}

/// What applies to every verb.
#[derive(Args, Clone, Debug, Default)]
pub struct GlobalArgs {
    /// Say nothing but errors.
    #[arg(short, long, global = true, help_heading = "Global", conflicts_with = "verbose")]
    pub quiet: bool,
    /// Say more; twice for everything. RUST_LOG wins.
    #[arg(short, long, global = true, help_heading = "Global", action = clap::ArgAction::Count)]
    pub verbose: u8,
    /// Vulkan device: its number or UUID as `labelgs devices` prints them, or a part of its name; otherwise
    /// LABELGS_DEVICE, otherwise the fastest kind.
    #[arg(long, value_name = "DEVICE", global = true, help_heading = "Global")]
    pub device: Option<String>,
}

/// The verbs.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Train a model on a posed scene, with object labels if there are masks.
    #[command(after_help = "Example: labelgs train garden --masks garden/masks -o out")]
    Train(Box<TrainArgs>),
    /// Render views of a model, or objects of it.
    #[command(after_help = "Example: labelgs render out --scene garden --views test --only 3 -o pictures")]
    Render(RenderArgs),
    /// Give the Gaussians of a trained model, of any trainer, their labels from masks.
    #[command(after_help = "Example: labelgs label model.ply --scene garden --masks garden/masks -o labelled.ply")]
    Label(super::label::LabelArgs),
    /// List the labels of a model.
    List(ListArgs),
    /// Write the Gaussians of some labels.
    #[command(after_help = "Example: labelgs extract out --labels 1,4-6 -o object.ply")]
    Extract(ExtractArgs),
    /// Write all but the Gaussians of some labels.
    #[command(after_help = "Example: labelgs remove out --labels 2 -o rest.ply")]
    Remove(SelectArgs),
    /// Write a model with another colour on some labels.
    #[command(after_help = "Example: labelgs recolour out --labels cup --colour 0.9,0.1,0.1 --mix 0.7 -o red.ply")]
    Recolour(RecolourArgs),
    /// Write a model with other ids.
    #[command(after_help = "Example: labelgs relabel out --map 3=7,4=0 -o model.ply")]
    Relabel(RelabelArgs),
    /// Write a model in which several labels are one.
    #[command(after_help = "Example: labelgs merge out --labels 3,5 --name table -o model.ply")]
    Merge(MergeArgs),
    /// Write a model in which each connected part of a label is a label of its own.
    #[command(after_help = "Example: labelgs split-components out --labels 3 --specks drop -o model.ply")]
    SplitComponents(SplitArgs),
    /// Score a model on the views of a scene.
    #[command(after_help = "Example: labelgs eval out --scene garden --masks garden/masks --json scores.json")]
    Eval(Box<EvalArgs>),
    /// Import, check and repair masks before training.
    Masks(MasksArgs),
    /// Find which objects hide which in each view, without training.
    #[command(after_help = "Example: labelgs occlusion garden --masks garden/masks --model out -o occlusion.json")]
    Occlusion(OcclusionArgs),
    /// Render a smooth video through the photos of a scene, for a tracker of objects.
    #[command(after_help = "Example: labelgs densify out --scene garden -o video")]
    Densify(DensifyArgs),
    /// Train a scene in several ways and compare the scores in one table.
    #[command(after_help = "Example: labelgs ablate garden --masks garden/masks -o ablation -- --iterations 3000")]
    Ablate(Box<super::ablate::AblateArgs>),
    /// Make a posed test scene with masks, whole outlines and depth.
    #[command(after_help = "Example: labelgs synth scene && labelgs train scene --masks scene/masks -o out")]
    Synth(SynthArgs),
    /// Compare the Vulkan devices with what is required.
    Devices(DevicesArgs),
    /// Print buffers, passes and barriers of a training step without running it.
    #[command(after_help = "Example: labelgs plan --gaussians 500k --size 960x540 --label-samples 10")]
    Plan(PlanArgs),
    /// Time training steps pass by pass.
    #[command(after_help = "Example: labelgs profile --synthetic --from-step 500 --steps 50")]
    Profile(ProfileArgs),
}

/// `--json` of a verb that prints its result.
#[derive(Args, Clone, Debug, Default)]
pub struct JsonFlag {
    /// Print the result as JSON.
    #[arg(id = "json_here", long = "json")]
    pub json: bool,
}

/// How a scene is read by a verb that does not train.
#[derive(Args, Clone, Debug)]
pub struct SceneArgs {
    /// Every N-th view by name is a test view; the value that the model was trained with.
    #[arg(long, value_name = "N", default_value_t = 8, help_heading = "Scene")]
    pub test_every: u32,
    /// Longest side of a picture, px; otherwise its own size.
    #[arg(long, value_name = "PX", value_parser = clap::value_parser!(u32).range(1..), help_heading = "Scene")]
    pub max_resolution: Option<u32>,
}

/// `labelgs render`.
#[derive(Args, Clone, Debug)]
#[command(group(clap::ArgGroup::new("from").required(true).args(["scene", "camera"])))]
pub struct RenderArgs {
    /// The model: a PLY, or the folder that `labelgs train` made.
    #[arg(value_name = "MODEL")]
    pub model: PathBuf,
    /// Scene whose cameras to use.
    #[arg(long, value_name = "SCENE")]
    pub scene: Option<PathBuf>,
    /// Which views: test, train, all, or names with commas between.
    #[arg(long, value_name = "VIEWS", default_value = "test", conflicts_with = "camera")]
    pub views: String,
    /// A camera of its own: JSON with w2c (4 x 4), fx, fy, cx, cy, W, H.
    #[arg(long, value_name = "CAM.json")]
    pub camera: Option<PathBuf>,
    /// Folder for the pictures, NAME.WHAT.png or .exr.
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// What to write of each view, with commas between.
    #[arg(long, value_name = "WHAT", value_enum, value_delimiter = ',', default_value = "rgb")]
    pub what: Vec<What>,
    /// Render only these labels, such as 1,4-6,cup, or those that --name, --at, --box and --mask choose.
    #[arg(long, value_name = "LABELS", value_parser = picks, num_args = 0..=1, conflicts_with = "without")]
    pub only: Option<Option<Picks>>,
    /// Render all but these labels, or all but those that --name, --at, --box and --mask choose.
    #[arg(long, value_name = "LABELS", value_parser = picks, num_args = 0..=1)]
    pub without: Option<Option<Picks>>,
    /// Which Gaussians of the labels of --only.
    #[command(flatten)]
    pub sure: SureArg,
    /// Labels by name and by place.
    #[command(flatten)]
    pub prompts: PromptArgs,
    /// Kind of file.
    #[arg(long, value_name = "FORMAT", value_enum, default_value = "png")]
    pub format: Format,
    /// Colour behind the scene: black, white, or R,G,B from 0 to 1.
    #[arg(long, value_name = "COLOUR", value_parser = colour, default_value = "black")]
    pub background: [f32; 3],
    /// How the scene is read.
    #[command(flatten)]
    pub reading: SceneArgs,
    /// JSON.
    #[command(flatten)]
    pub json: JsonFlag,
}

/// `labelgs list`.
#[derive(Args, Clone, Debug)]
pub struct ListArgs {
    /// The model: a PLY, or the folder that `labelgs train` made.
    #[arg(value_name = "MODEL")]
    pub model: PathBuf,
    /// Names.
    #[command(flatten)]
    pub table: TableArg,
    /// JSON.
    #[command(flatten)]
    pub json: JsonFlag,
}

/// `labelgs synth`.
#[derive(Args, Clone, Debug)]
pub struct SynthArgs {
    /// Folder to make; must be new or empty.
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
    /// Which objects.
    #[arg(long, value_name = "PRESET", value_enum, default_value = "default")]
    pub preset: Preset,
    /// Size of a picture, px.
    #[arg(long, value_name = "WxH", value_parser = size, default_value = "320x240")]
    pub size: Size,
    /// Number of views.
    #[arg(long, value_name = "N", default_value_t = 40)]
    pub views: u32,
    /// Number of 3-D points.
    #[arg(long, value_name = "N", default_value_t = 4000)]
    pub points: u32,
    /// Seed of colours, camera jitter and points.
    #[arg(long, value_name = "SEED", default_value_t = 0)]
    pub seed: u64,
    /// JSON.
    #[command(flatten)]
    pub json: JsonFlag,
}

/// `labelgs devices`.
#[derive(Args, Clone, Debug)]
pub struct DevicesArgs {
    /// JSON.
    #[command(flatten)]
    pub json: JsonFlag,
}

/// `labelgs plan`.
#[derive(Args, Clone, Debug)]
pub struct PlanArgs {
    /// Number of Gaussians to plan for, such as 500k or 2M.
    #[arg(long, value_name = "N", value_parser = count, default_value = "1M")]
    pub gaussians: u64,
    /// Size of a picture, px.
    #[arg(long, value_name = "WxH", value_parser = size, default_value = "1600x1064")]
    pub size: Size,
    /// Objects per step; 0 plans without labels.
    #[arg(long, value_name = "N", default_value_t = 10)]
    pub label_samples: u32,
    /// Degree of the spherical harmonics.
    #[arg(long, value_name = "DEGREE", value_parser = clap::value_parser!(u32).range(0..=3), default_value_t = 3)]
    pub sh_degree: u32,
    /// JSON.
    #[command(flatten)]
    pub json: JsonFlag,
}

/// `labelgs profile`.
#[derive(Args, Clone, Debug)]
#[command(group(clap::ArgGroup::new("input").required(true).args(["scene", "synthetic", "compare"])))]
pub struct ProfileArgs {
    /// Scene to time.
    #[arg(value_name = "SCENE")]
    pub scene: Option<PathBuf>,
    /// Time the scene of `labelgs synth` instead, with its masks.
    #[arg(long)]
    pub synthetic: bool,
    /// Folder of id masks.
    #[arg(long, value_name = "DIR", conflicts_with = "synthetic")]
    pub masks: Option<PathBuf>,
    /// Leave out the masks of --synthetic.
    #[arg(long, requires = "synthetic")]
    pub no_masks: bool,
    /// Steps to time.
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..))]
    pub steps: u32,
    /// Steps before the clock starts.
    #[arg(long, value_name = "N", default_value_t = 20)]
    pub warm_up: u32,
    /// Train so many steps first, so that a trained scene is measured.
    #[arg(long, value_name = "S", default_value_t = 0)]
    pub from_step: u32,
    /// Start from this model, a PLY or the folder that `labelgs train` made, instead of the scene's points.
    #[arg(long, value_name = "MODEL")]
    pub model: Option<PathBuf>,
    /// Settings of training in TOML, as config.toml of an earlier run. Labels start at --from-step at the latest.
    #[arg(long, value_name = "FILE.toml")]
    pub config: Option<PathBuf>,
    /// Let passes overlap as in training: the wall clock is then the true one, times of passes are what each added.
    #[arg(long)]
    pub overlap: bool,
    /// How the scene is read.
    #[command(flatten)]
    pub reading: SceneArgs,
    /// Instead compare two files that --json wrote; fail with status 1 if a stage became slower beyond noise.
    #[arg(long, value_names = ["OLD.json", "NEW.json"], num_args = 2, conflicts_with_all = ["scene", "synthetic", "model"])]
    pub compare: Option<Vec<PathBuf>>,
    /// With --compare: by how much a median may grow.
    #[arg(long, value_name = "SHARE", value_parser = share, default_value_t = 0.05, requires = "compare")]
    pub tolerance: f32,
    /// Write the numbers as JSON to FILE; without FILE print them.
    #[arg(id = "json_file", long = "json", value_name = "FILE", num_args = 0..=1)]
    pub json: Option<Option<PathBuf>>,
}
