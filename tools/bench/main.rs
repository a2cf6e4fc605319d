//! Benchmarks: run time against error, the cost of a step and of a label, memory, and two programs against each other.
//!
//! `tools/bench/run COMMAND` builds with optimisation and runs a benchmark. It prints tables and writes JSON to
//! `--output`. With `--small` it does the same in seconds on tiny scenes, as in the tests.
#![allow(
    clippy::disallowed_methods,
    clippy::too_many_lines,
    reason = "the rules of files and lengths are those of the library"
)]

mod clicks;
mod compiler;
mod device;
mod kernels;
mod large;
mod limits;
mod measure;
mod memory;
mod meshes;
mod order;
mod pace;
#[allow(dead_code, reason = "what the build does with shaders; benchmarks generate nothing")]
#[path = "../shadergen/mod.rs"]
mod shadergen;
mod sort;
mod split;
mod steps;
mod strokes;
mod tile;
mod trained;
mod training;

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
    /// Tiny scenes and few repetitions; times are then meaningless.
    #[arg(long)]
    pub small: bool,
    /// Folder for JSON files.
    #[arg(long, short, value_name = "DIR", default_value = "target/bench")]
    pub output: PathBuf,
}

#[derive(Subcommand)]
enum Command {
    /// Time against error of every mode of the kernels.
    Kernels(kernels::KernelArgs),
    /// Cost of a step with labels relative to one without, by covered area and number of objects.
    Steps(Common),
    /// Quality against CPU time of this program and another.
    Training(training::Options),
    /// Scores of real captures, as papers report them, beside those of other trainers.
    Real(training::real::Options),
    /// Rates and costs of the device, and how close each stage of a step comes to the resulting limit.
    Limits(Common),
    /// The blends of synthetic splats: the chain of a single tile, and an image of equal tiles.
    Tile(Common),
    /// The sort in each form that the device supports.
    Sort(Common),
    /// Bytes of a step for different orders of the Gaussians.
    Order(order::Options),
    /// Objects from simulated clicks, compared with true masks.
    Clicks(clicks::Options),
    /// Meshes of a trained model's objects, compared with the true surfaces.
    Meshes(meshes::Options),
    /// Objects from simulated strokes, compared with true masks.
    Strokes(strokes::Options),
    /// A large model made from a trained one, for timing.
    Split(split::Options),
    /// Predicted against measured memory of training.
    Memory(Common),
    /// A city larger than the device's memory: its renders, its list, one of its objects.
    Large(large::Options),
    /// One measurement of `memory`, in a separate process.
    #[command(hide = true)]
    MemoryOf { gaussians: u32, width: u32, height: u32 },
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
        Command::Training(options) => training::run(&options),
        Command::Real(options) => training::real::run(&options),
        Command::Limits(common) => limits::run(&common),
        Command::Tile(common) => tile::run(&common),
        Command::Sort(common) => sort::run(&common),
        Command::Order(options) => order::run(&options),
        Command::Clicks(options) => clicks::run(&options),
        Command::Meshes(options) => meshes::run(&options),
        Command::Strokes(options) => strokes::run(&options),
        Command::Split(options) => split::run(&options),
        Command::Memory(common) => memory::run(&common),
        Command::Large(options) => large::run(&options),
        Command::MemoryOf { gaussians, width, height } => memory::measure(gaussians, width, height),
    }
}
