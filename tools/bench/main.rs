//! Benchmarks: run time against error, and the cost of a step, an object and a label.
//!
//! `tools/bench/run COMMAND` builds with optimisation and runs one of them. Each prints its tables and writes JSON and
//! charts into `--output`. With `--small` it does the same in seconds on tiny scenes, as the tests run it.
#![allow(
    clippy::disallowed_methods,
    clippy::too_many_lines,
    reason = "the rules of files and lengths are those of the library"
)]

mod compiler;
mod device;
mod exposures;
mod kernels;
mod large;
mod limits;
mod measure;
mod memory;
mod pace;
mod poses;
#[allow(dead_code, reason = "what the build does with shaders; benchmarks generate nothing")]
#[path = "../shadergen/mod.rs"]
mod shadergen;
mod start;
mod steps;
mod trained;
mod training;
mod view;
mod zoom;

use clap::{Parser, Subcommand};
use labelgs::Result;
use std::path::PathBuf;

/// Benchmarks of labelgs.
#[derive(Parser)]
#[command(name = "tools/bench/run")]
struct Arguments {
    #[command(subcommand)]
    command: Command,
    /// Argument that cargo passes to every benchmark.
    #[arg(long, hide = true, global = true)]
    bench: bool,
}

/// Options of all benchmarks.
#[derive(clap::Args, Clone, Debug)]
pub struct Common {
    /// Tiny scenes and few repetitions; times mean nothing then.
    #[arg(long)]
    pub small: bool,
    /// Folder of JSON files and charts.
    #[arg(long, short, value_name = "DIR", default_value = "target/bench")]
    pub output: PathBuf,
}

#[derive(Subcommand)]
enum Command {
    /// Time against error of every mode of the kernels.
    Kernels(kernels::KernelArgs),
    /// Cost of a step with labels relative to one without, by covered area and number of objects.
    Steps(Common),
    /// Quality against seconds of training, with and without labels, and the time to the first step.
    Training(training::Options),
    /// How near each stage of a step comes to the limit of the device, measured in the same run.
    Limits(Common),
    /// Poses that are off, with and without refinement: what is left of the errors, and the quality.
    Poses(poses::Options),
    /// What the exposures of a capture cost, and what their matrices take back.
    Exposures(exposures::Options),
    /// Pictures larger and smaller than the photos, with and without antialiasing, against traced ones.
    Zoom(zoom::Options),
    /// Predicted against measured memory of training.
    Memory(Common),
    /// From the start of the program to its first picture, with empty and with filled caches.
    Start(Common),
    /// A city that is larger than the memory of the device: its pictures, its list, one object of it.
    Large(large::Options),
    /// The viewer: from a camera to its picture, what watching costs a training, bytes of page and program.
    View(Common),
    /// One measurement of `memory`, in a process of its own.
    #[command(hide = true)]
    MemoryOf { gaussians: u32, width: u32, height: u32 },
    /// Time to the first step of a training, in a process of its own.
    #[command(hide = true)]
    FirstStep(Common),
}

fn main() -> std::process::ExitCode {
    let outcome = run().and_then(|()| device::require_silence());
    if let Err(error) = outcome {
        eprintln!("bench: {error}");
        return std::process::ExitCode::FAILURE;
    }
    std::process::ExitCode::SUCCESS
}

fn run() -> Result<()> {
    match Arguments::parse().command {
        Command::Kernels(args) => kernels::run(&args),
        Command::Steps(common) => steps::run(&common),
        Command::Poses(options) => poses::run(&options),
        Command::Exposures(options) => exposures::run(&options),
        Command::Zoom(options) => zoom::run(&options),
        Command::Training(options) => training::run(&options),
        Command::FirstStep(common) => training::first_step(&common),
        Command::Limits(common) => limits::run(&common),
        Command::Memory(common) => memory::run(&common),
        Command::Start(common) => start::run(&common),
        Command::View(common) => view::run(&common),
        Command::Large(options) => large::run(&options),
        Command::MemoryOf { gaussians, width, height } => memory::measure(gaussians, width, height),
    }
}
