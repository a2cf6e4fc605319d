//! Benchmarks: run time against error, and what a step, an object and a label cost.
//!
//! `tools/bench/run COMMAND` builds with optimisation and runs one of them. Each prints its tables and writes JSON and
//! charts into `--output`. With `--small` it does the same in seconds on tiny scenes, as the tests run it.

mod device;
mod memory;
mod pace;
mod start;
mod steps;

use clap::{Parser, Subcommand};
use labelgs::Result;
use labelgs::io::atomic;
use serde_json::Value;
use std::path::PathBuf;

/// Benchmarks of labelgs.
#[derive(Parser)]
#[command(name = "tools/bench/run")]
struct Arguments {
    #[command(subcommand)]
    command: Command,
    /// What cargo hands to every benchmark.
    #[arg(long, hide = true, global = true)]
    bench: bool,
}

/// What all benchmarks know.
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
    /// What a step with labels costs beside one without, by covered area and number of objects.
    Steps(Common),
    /// Predicted against measured memory of training.
    Memory(Common),
    /// From the start of the program to its first picture, with empty and with filled caches.
    Start(Common),
    /// One measurement of `memory`, in a process of its own.
    #[command(hide = true)]
    MemoryOf { gaussians: u32, width: u32, height: u32 },
}

fn main() -> std::process::ExitCode {
    let outcome = run();
    if let Err(error) = outcome {
        eprintln!("bench: {error}");
        return std::process::ExitCode::FAILURE;
    }
    std::process::ExitCode::SUCCESS
}

fn run() -> Result<()> {
    match Arguments::parse().command {
        Command::Steps(common) => steps::run(&common),
        Command::Memory(common) => memory::run(&common),
        Command::Start(common) => start::run(&common),
        Command::MemoryOf { gaussians, width, height } => memory::measure(gaussians, width, height),
    }
}

/// Writes a benchmark's numbers into the output folder.
pub fn write_json(common: &Common, name: &str, numbers: &Value) -> Result<()> {
    let path = common.output.join(format!("{name}.json"));
    atomic::write(&path, |to| writeln!(to, "{numbers:#}"))?;
    println!("{}", path.display());
    Ok(())
}
