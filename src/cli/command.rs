//! The command line as a whole: its verbs with their examples.

use super::ablate::AblateArgs;
use super::args::GlobalArgs;
use super::densify::DensifyArgs;
use super::devices::DevicesArgs;
use super::eval::EvalArgs;
use super::label::LabelArgs;
use super::list::ListArgs;
use super::masks::MasksArgs;
use super::merge::MergeArgs;
use super::occlusion::OcclusionArgs;
use super::plan::PlanArgs;
use super::profile::ProfileArgs;
use super::recolour::RecolourArgs;
use super::relabel::RelabelArgs;
use super::render::RenderArgs;
use super::select::{ExtractArgs, SelectArgs};
use super::selftest::SelftestArgs;
use super::split_components::SplitArgs;
use super::synth::SynthArgs;
use super::train_args::TrainArgs;
use super::wording::flag;
use crate::run::Settings;
use clap::{CommandFactory, Parser, Subcommand};
use std::collections::BTreeMap;

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
    Label(LabelArgs),
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
    Ablate(Box<AblateArgs>),
    /// Make a posed test scene with masks, whole outlines and depth.
    #[command(after_help = "Example: labelgs synth scene && labelgs train scene --masks scene/masks -o out")]
    Synth(SynthArgs),
    /// Compare the Vulkan devices with what is required.
    Devices(DevicesArgs),
    /// Check a device: every pass against float64, gradients, determinism.
    #[command(after_help = "Example: labelgs selftest --device 0 && labelgs train scene -o out")]
    Selftest(SelftestArgs),
    /// Print buffers, passes and barriers of a training step without running it.
    #[command(after_help = "Example: labelgs plan --gaussians 500k --size 960x540 --label-samples 10")]
    Plan(PlanArgs),
    /// Time training steps pass by pass.
    #[command(after_help = "Example: labelgs profile --synthetic --from-step 500 --steps 50")]
    Profile(ProfileArgs),
}

/// The command with the defaults of training in its help.
pub fn command() -> clap::Command {
    let mut defaults = Settings::default().texts();
    let paper = paper_flags(&defaults);
    // What the values alone do not tell.
    for (key, text) in [
        ("background", "black"),
        ("save_at", "none"),
        ("near", "0.2, less in a small scene"),
        ("feature_rest_lr", "--feature-lr / 20"),
    ] {
        defaults.insert(key.into(), text.into());
    }
    Cli::command().mut_subcommand("train", |train| {
        train.mut_args(|arg| {
            if arg.get_id() == "paper" {
                let help = arg.get_help().map(ToString::to_string).unwrap_or_default();
                return arg.help(format!("{help} {paper}"));
            }
            let Some(default) = defaults.get(arg.get_id().as_str()) else { return arg };
            let with = |help: String| format!("{help} [default: {default}]");
            let (short, long) = (arg.get_help().map(ToString::to_string), arg.get_long_help().map(ToString::to_string));
            let arg = if let Some(help) = short { arg.help(with(help)) } else { arg };
            if let Some(help) = long { arg.long_help(with(help)) } else { arg }
        })
    })
}

/// The settings of the paper that are no defaults, as flags.
fn paper_flags(defaults: &BTreeMap<String, String>) -> String {
    let paper = Settings::paper().texts();
    let changed = Settings::keys().filter_map(|key| {
        let value = paper.get(key.name).filter(|value| defaults.get(key.name) != Some(value))?;
        Some(format!("{} {value}", flag(key.name)))
    });
    changed.collect::<Vec<_>>().join(" ")
}
