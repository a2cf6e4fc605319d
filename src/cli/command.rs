//! The command line as a whole: its commands, each with an example that runs where `scene` and `out` are.

use crate::cli::commands::{
    ablate, benchmark, blocks, check, clean, convert, devices, edit, eval, extract_remove, frames, kernels, label,
    list, masks, merge, occlusion, photos, plan, profile, recolour, relabel, render, report, selftest, simplify,
    split_components, synth, train, transform, view,
};
use crate::cli::support::{Context, GlobalArgs, settings};
use crate::{Result, version};
use clap::{Arg, ArgAction, ArgMatches, CommandFactory, Parser, Subcommand};
use std::sync::LazyLock;

const EXIT_STATUSES: &str = "\
Exit status: 0 done, 1 finished but a requested check failed, 2 usage, 3 bad input, 4 no usable device, 5 out of memory, \
6 device lost, 7 output, 8 numerical failure, 70 a bug, 130 or 143 interrupted.
Results go to standard output, everything else to standard error.";

/// Label-aware 3D Gaussian Splatting on Vulkan compute: train a model of a scene, then list, extract, remove, render
/// and score its objects.
///
/// Example: labelgs synth scene && labelgs train scene --masks scene/masks -o out && labelgs list out
#[derive(Debug, Parser)]
#[command(name = "labelgs", version, propagate_version = true)]
pub struct Cli {
    /// Print the result as JSON.
    #[arg(long, help_heading = "Output")]
    pub json: bool,
    /// Flags of every command.
    #[command(flatten)]
    pub global: GlobalArgs,
    /// The command.
    #[command(subcommand)]
    pub command: Command,
}

/// The commands, in the order of the help: what a newcomer needs comes first.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Generate a synthetic test scene: photos with poses, points, masks, whole outlines and depth.
    ///
    /// Example: labelgs synth scene
    Synth(synth::SynthArgs),
    /// Make a scene from photos without poses, or from a video. Needs COLMAP, and ffmpeg for videos.
    ///
    /// Example: labelgs photos pictures -o scene
    Photos(photos::PhotosArgs),
    /// Train a model from the photos of a scene. With masks, every Gaussian gets the label of its object.
    ///
    /// Example: labelgs train scene --masks scene/masks --iterations 3000 -o out
    Train(Box<train::args::TrainArgs>),
    /// Score a model against the photos of its scene: PSNR, SSIM and, with masks, IoU.
    ///
    /// Example: labelgs eval out --scene scene --masks scene/masks
    Eval(Box<eval::EvalArgs>),
    /// List the objects of a model with label id, name, number of Gaussians, position and size.
    ///
    /// Example: labelgs list out
    List(list::ListArgs),
    /// Extract objects: write a model with only the chosen objects.
    ///
    /// Example: labelgs extract out --labels 3 -o object.ply
    Extract(extract_remove::ExtractArgs),
    /// Remove objects: write a model without the chosen objects.
    ///
    /// Example: labelgs remove out --labels 3 -o rest.ply
    Remove(extract_remove::RemoveArgs),
    /// Render images, depth or label maps of a model or of some of its objects.
    ///
    /// Example: labelgs render out --scene scene --only 3 -o images
    Render(render::RenderArgs),
    /// Rewrite the report of a run, or compare several runs on one page.
    ///
    /// Example: labelgs report out
    Report(report::ReportArgs),
    /// Replay the edits made in the viewer; gives the same model, byte for byte.
    ///
    /// Example: labelgs edit out --replay out/edits/001.edits.json -o changed.ply
    Edit(edit::ReplayArgs),
    /// View a model in a browser, compare it with its photos, and edit its objects.
    ///
    /// Example: labelgs view out --scene scene --masks scene/masks --open
    View(Box<view::ViewArgs>),
    /// Change the colour of objects.
    ///
    /// Example: labelgs recolour out --labels barrel --colour 0.9,0.1,0.1 --mix 0.7 -o red.ply
    #[command(alias = "recolor")]
    Recolour(recolour::RecolourArgs),
    /// Change label ids.
    ///
    /// Example: labelgs relabel out --map 3=7,4=0 -o relabelled.ply
    Relabel(relabel::RelabelArgs),
    /// Merge several labels into one.
    ///
    /// Example: labelgs merge out --labels 3,5 --name group -o merged.ply
    Merge(merge::MergeArgs),
    /// Split a label into its connected components, each with its own label.
    ///
    /// Example: labelgs split-components out --labels 3 --specks drop -o parts.ply
    SplitComponents(split_components::SplitArgs),
    /// Convert a model to another format: PLY, SPZ, GLB, SOG, USD or a self-contained HTML page. The file extension
    /// decides the format.
    ///
    /// Example: labelgs convert out scene.spz
    Convert(convert::ConvertArgs),
    /// Remove floaters: faint, huge, isolated or distant Gaussians.
    ///
    /// Example: labelgs clean out --min-opacity 0.02 --max-gap 10 -o clean.ply
    Clean(clean::CleanArgs),
    /// Reduce the number of Gaussians by merging neighbours of the same label, and print the loss of quality.
    ///
    /// Example: labelgs simplify out --scene scene --psnr-loss 0.2 -o small.ply
    Simplify(simplify::SimplifyArgs),
    /// Rotate a model upright, scale it or move it.
    ///
    /// Example: labelgs transform out --up z --scale 0.5 --origin 0,0,1 -o upright.ply
    Transform(transform::TransformArgs),
    /// Label a model of any trainer, from masks, clicks, strokes, or a labelled copy of the model.
    ///
    /// Example: labelgs label out --scene scene --masks scene/masks -o labelled.ply
    Label(label::LabelArgs),
    /// Import, check and repair masks before training.
    ///
    /// Example: labelgs masks import scene/masks --scene scene -o imported
    #[command(subcommand)]
    Masks(masks::MasksVerb),
    /// Find problems in a scene before training: bad poses, blur, uneven exposure or white balance, isolated photos,
    /// unusual scale. Exits with status 1 if there are any.
    ///
    /// Example: labelgs check scene
    Check(check::CheckArgs),
    /// List which objects occlude which in each view, without training.
    ///
    /// Example: labelgs occlusion scene --masks scene/masks --model out -o occlusion.json
    Occlusion(occlusion::OcclusionArgs),
    /// Render a smooth video through the photos of a scene, as input for an object tracker.
    ///
    /// Example: labelgs frames out --scene scene -o video
    Frames(frames::FramesArgs),
    /// Train variants of a scene and compare their scores in one table.
    ///
    /// Example: labelgs ablate scene --masks scene/masks -o ablation -- --iterations 3000
    Ablate(Box<ablate::AblateArgs>),
    /// Train a scene that is too large for one GPU: split it into blocks and join the trained models.
    ///
    /// Example: labelgs blocks split scene --model out --card 24G --dry-run
    #[command(subcommand)]
    Blocks(Box<blocks::BlocksVerb>),
    /// Score a model as a published benchmark does: with its masks, prompts and averages.
    ///
    /// Example: labelgs benchmark out --scene scene --protocol binary --truth scene/amodal --objects 3
    Benchmark(Box<benchmark::BenchmarkArgs>),
    /// List the Vulkan devices and whether labelgs supports them.
    ///
    /// Example: labelgs devices
    Devices,
    /// Test a device: compare every pass with float64, and check gradients and determinism.
    ///
    /// Example: labelgs selftest
    Selftest(selftest::SelftestArgs),
    /// Show the memory, passes and barriers of a training step, without running it.
    ///
    /// Example: labelgs plan --gaussians 500k --size 960x540 --label-samples 10
    Plan(plan::PlanArgs),
    /// Compile every kernel and show its registers, spills and instructions.
    ///
    /// The numbers come from the driver. Exits with status 1 if a kernel spills.
    ///
    /// Example: labelgs kernels
    Kernels(kernels::KernelsArgs),
    /// Measure the time of each pass of a training step.
    ///
    /// Example: labelgs profile scene --masks scene/masks --steps 50
    Profile(profile::ProfileArgs),
}

impl Command {
    /// Runs the command.
    pub(super) fn run(&self, context: &Context) -> Result<()> {
        match self {
            Self::Synth(args) => synth::run(args, context),
            Self::Photos(args) => photos::run(args, context),
            Self::Train(args) => train::run(args, context),
            Self::Eval(args) => eval::run(args, context),
            Self::List(args) => list::run(args, context),
            Self::Extract(args) => extract_remove::run_extract(args, context),
            Self::Remove(args) => extract_remove::run_remove(args, context),
            Self::Edit(args) => edit::run(args, context),
            Self::Render(args) => render::run(args, context),
            Self::Report(args) => report::run(args, context),
            Self::View(args) => view::run(args, context),
            Self::Recolour(args) => recolour::run(args, context),
            Self::Relabel(args) => relabel::run(args, context),
            Self::Merge(args) => merge::run(args, context),
            Self::SplitComponents(args) => split_components::run(args, context),
            Self::Convert(args) => convert::run(args, context),
            Self::Clean(args) => clean::run(args, context),
            Self::Simplify(args) => simplify::run(args, context),
            Self::Transform(args) => transform::run(args, context),
            Self::Label(args) => label::run(args, context),
            Self::Masks(verb) => verb.run(context),
            Self::Check(args) => check::run(args, context),
            Self::Occlusion(args) => occlusion::run(args, context),
            Self::Frames(args) => frames::run(args, context),
            Self::Ablate(args) => ablate::run(args, context),
            Self::Blocks(verb) => verb.run(context),
            Self::Benchmark(args) => benchmark::run(args, context),
            Self::Devices => devices::run(context),
            Self::Selftest(args) => selftest::run(args, context),
            Self::Plan(args) => plan::run(args, context),
            Self::Kernels(args) => kernels::run(args, context),
            Self::Profile(args) => profile::run(args, context),
        }
    }
}

/// Commands for developers of the engine: the help lists them under a heading of their own.
const DEVELOPER_COMMANDS: [&str; 4] = ["selftest", "plan", "kernels", "profile"];

/// Text of `--version`; clap needs a static string.
static VERSION: LazyLock<String> = LazyLock::new(version::text);

/// Returns the command line with the defaults of training in its help, and commit and features in its `--version`.
pub fn command() -> clap::Command {
    let root = Cli::command().after_help(EXIT_STATUSES).long_version(VERSION.as_str());
    with_json(root.mut_subcommand("train", settings::in_help))
}

/// `--json` after the name of a command.
const LOCAL_JSON_ARG: &str = "json_here";

/// Adds `--json` to all commands that do not define it.
fn with_json(command: clap::Command) -> clap::Command {
    if command.has_subcommands() {
        return command.mut_subcommands(with_json);
    }
    if command.get_arguments().any(|arg| arg.get_long() == Some("json")) {
        return command;
    }
    let json = Arg::new(LOCAL_JSON_ARG).long("json").action(ArgAction::SetTrue);
    command.arg(json.help("Print the result as JSON").help_heading("Output"))
}

/// Returns true if the added `--json` was typed.
pub(super) fn has_json(typed: &ArgMatches) -> bool {
    let here = typed.try_get_one(LOCAL_JSON_ARG).is_ok_and(|flag| flag == Some(&true));
    here || typed.subcommand().is_some_and(|(_, words)| has_json(words))
}

/// Returns the command line whose help has the developers' commands under a heading of their own.
pub(crate) fn with_headings(root: clap::Command) -> clap::Command {
    let mut list = "Commands for developers of the engine:\n".to_owned();
    for command in DEVELOPER_COMMANDS.iter().filter_map(|name| root.find_subcommand(name)) {
        let about = command.get_about().map(ToString::to_string).unwrap_or_default();
        list += &format!("  {:<16}  {about}\n", command.get_name());
    }
    let root =
        DEVELOPER_COMMANDS.iter().fold(root, |root, name| root.mut_subcommand(name, |command| command.hide(true)));
    root.after_help(format!("{list}\n{EXIT_STATUSES}"))
}
