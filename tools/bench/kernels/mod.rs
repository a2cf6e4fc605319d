//! Kernels: time against error of every mode.
//!
//! A mode is a training step whose kernels are compiled with a macro (`modes`). It runs in the engine's own scheduler
//! on seeded scenes and is timed round robin with all others by the device's timestamps. Its image and gradients are
//! compared with the float64 mirrors of the tests: once with the engine's rules, and once without any cut-off, which
//! those rules approximate.

mod bed;
mod errors;
mod measure;
mod mirror;
mod modes;
mod pairs;
mod report;
mod scenes;

pub use bed::TestBed;
pub use modes::{ALL_MODES, Mode, Replacements};

use super::Common;
use super::measure::write_json;
use labelgs::{Error, Result};
use measure::SceneResult;
use serde_json::json;

/// Options of this benchmark.
#[derive(clap::Args, Clone, Debug)]
pub struct KernelArgs {
    #[command(flatten)]
    common: Common,
    /// Only these scenes.
    #[arg(long, value_name = "NAME,..", value_delimiter = ',')]
    scenes: Vec<String>,
    /// Only these modes, by their number in a full run; the default is always included.
    #[arg(long, value_name = "N,..", value_delimiter = ',')]
    modes: Vec<usize>,
    /// Timed rounds of every scene.
    #[arg(long, value_name = "N")]
    rounds: Option<usize>,
}

/// Runs the benchmark.
pub fn run(args: &KernelArgs) -> Result<()> {
    let load_before = super::measure::load();
    let gpu = super::device::open()?;
    let wanted = |number: usize| number == 0 || args.modes.is_empty() || args.modes.contains(&number);
    let modes = ALL_MODES.iter().enumerate().filter(|(number, _)| wanted(*number));
    let modes: Vec<_> = modes.map(|(_, mode)| (*mode, Replacements::default())).collect();
    let plain: Vec<Mode> = modes.iter().map(|(mode, _)| *mode).collect();
    let capabilities = gpu.capabilities();
    let driver = format!("{} {}", capabilities.driver_name, capabilities.driver_info);
    println!("{}, {driver}", capabilities.name);
    report::legend(&plain);
    let mut scenes = Vec::new();
    let mut failures = Vec::new();
    for mut plan in scenes::plans(args.common.small) {
        if !args.scenes.is_empty() && !args.scenes.iter().any(|name| name.eq_ignore_ascii_case(plan.name)) {
            continue;
        }
        plan.rounds = args.rounds.unwrap_or(plan.rounds).max(1);
        let scene = measure::scene(&gpu, &plan, &modes)?;
        report::scene(&scene);
        failures.extend(faults(&scene, plan.kind));
        scenes.push(scene);
    }
    let pairs = pairs::run(&gpu, if args.common.small { 2 } else { 40 })?;
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    write_json(
        &args.common.output.join("kernels.json"),
        &json!({ "schema_version": 3, "small": args.common.small, "device": capabilities.name, "driver": driver,
            "threads": threads, "load_before": load_before, "scenes": scenes, "pairs": pairs }),
    )?;
    if failures.is_empty() { Ok(()) } else { Err(Error::Check(failures.join("; "))) }
}

/// Returns failures: NaN, or a default mode with too large an error.
fn faults(scene: &SceneResult, kind: scenes::Kind) -> Vec<String> {
    let mut faults: Vec<String> = measure::fault_of_default(scene, kind).into_iter().collect();
    for mode in &scene.modes {
        let errors = [&mode.against_rules, &mode.against_no_cut_offs];
        if errors.into_iter().any(|errors| !errors.are_finite()) {
            faults.push(format!("{}: mode `{}` gives numbers that are not finite", scene.name, mode.name));
        }
    }
    faults
}
