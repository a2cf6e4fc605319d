//! Predicted against measured memory of training, on a device that uses host memory.

use super::measure::write_json;
use super::trained::timed_step;
use super::{Common, device};
use glam::{DMat3, DVec3};
use labelgs::engine::Engine;
use labelgs::run::TrainConfig;
use labelgs::scene::{Camera, Dataset, Gaussians, LabelMap, Photo, View};
use labelgs::scheduler::SchedulerOptions;
use labelgs::train::Trainer;
use labelgs::{Error, Result};
use rand::rngs::SmallRng;
use rand::{Rng, SeedableRng};
use serde_json::{Value, json};
use std::process::Command;
use std::sync::Arc;

/// Allowed difference between prediction and measurement.
const RATIO_TOLERANCE: f64 = 0.1;
/// Steps of each training.
const STEP_COUNT: u32 = 2;

/// Measures each size in a separate process, so that none reuses memory of an earlier size.
pub fn run(common: &Common) -> Result<()> {
    if !device::open()?.is_cpu() {
        println!("memory: the memory of this device is not the host's; nothing to measure");
        return Ok(());
    }
    let sizes: &[(u32, u32, u32)] = if common.small {
        &[(40_000, 320, 240)]
    } else {
        &[(50_000, 320, 240), (250_000, 640, 480), (1_000_000, 640, 480)]
    };
    println!(
        "{:>10} {:>11} {:>14} {:>13} {:>7} {:>12}",
        "Gaussians", "pixels", "predicted MiB", "measured MiB", "ratio", "step 2, s"
    );
    let mut rows = Vec::new();
    for &(count, width, height) in sizes {
        let row = in_a_process(count, width, height)?;
        let number = |name: &str| row[name].as_f64().unwrap_or(f64::NAN);
        let (predicted, measured) = (number("predicted") / 1_048_576.0, number("measured") / 1_048_576.0);
        println!(
            "{count:>10} {:>11} {predicted:>14.1} {measured:>13.1} {:>7.3} {:>12.2}",
            format!("{width} x {height}"),
            measured / predicted,
            number("seconds")
        );
        rows.push(row);
    }
    write_json(&common.output.join("memory.json"), &json!({ "schema_version": 1, "rows": rows }))?;
    let ratio =
        |row: &Value| row["measured"].as_f64().unwrap_or(f64::NAN) / row["predicted"].as_f64().unwrap_or(f64::NAN);
    match rows.iter().map(ratio).find(|ratio| !((1.0 - ratio).abs() <= RATIO_TOLERANCE)) {
        None => Ok(()),
        Some(ratio) => Err(Error::Bug(format!("measured memory is {ratio:.3} of the predicted, more than 10 % off"))),
    }
}

fn in_a_process(count: u32, width: u32, height: u32) -> Result<Value> {
    let problem = |text: String| Error::Bug(format!("the measuring process: {text}"));
    let program = std::env::current_exe().map_err(|error| problem(error.to_string()))?;
    let arguments = ["memory-of".to_owned(), count.to_string(), width.to_string(), height.to_string()];
    let output = Command::new(program).args(arguments).output().map_err(|error| problem(error.to_string()))?;
    if !output.status.success() {
        return Err(problem(String::from_utf8_lossy(&output.stderr).trim().to_owned()));
    }
    serde_json::from_slice(&output.stdout).map_err(|error| problem(error.to_string()))
}

/// Trains two steps and prints, as JSON, the predicted memory and the peak growth of resident memory.
pub fn measure(count: u32, width: u32, height: u32) -> Result<()> {
    let gpu = device::open()?;
    let config = TrainConfig {
        iterations: 10,
        label_from: Some(1),
        densify_from: Some(u32::MAX),
        start_size: Some(1.0),
        ..TrainConfig::default()
    };
    let options = SchedulerOptions { poison_step: true, ..SchedulerOptions::default() };
    // Train on a single Gaussian first, which compiles all kernels, because compiled code is not the engine's memory.
    let small = scene(1, width, height);
    steps(&mut Trainer::new(Arc::clone(&gpu), config.clone(), &small.0, &small.1, options)?)?;
    let (dataset, model) = scene(count, width, height);
    let before = resident("VmRSS:")?;
    let mut trainer = Trainer::new(Arc::clone(&gpu), config, &dataset, &model, options)?;
    let seconds = steps(&mut trainer)?;
    let predicted = Engine::predict(&gpu, trainer.engine_mut().size(), options)?.total;
    let measured = resident("VmRSS:")?.saturating_sub(before);
    let peak = resident("VmHWM:")?.saturating_sub(before);
    let row = json!({
        "gaussians": count, "size": [width, height], "predicted": predicted, "measured": measured, "peak": peak,
        "seconds": seconds,
    });
    println!("{row}");
    Ok(())
}

/// Runs the steps and returns the seconds of the last one.
fn steps(trainer: &mut Trainer) -> Result<f64> {
    let mut seconds = 0.0;
    for _ in 0..STEP_COUNT {
        seconds = timed_step(trainer)?.1.wall / 1e3;
    }
    Ok(seconds)
}

/// Random small Gaussians of degree 3 in a ball in front of a camera; two of them belong to objects.
pub fn scene(count: u32, width: u32, height: u32) -> (Dataset, Gaussians) {
    let mut random = SmallRng::seed_from_u64(7);
    let mut model = Gaussians { sh_degree: 3, ..Gaussians::default() };
    for _ in 0..count {
        model.means.push(std::array::from_fn(|_| random.random_range(-1.0..1.0)));
        model.scales.push([-5.5; 3]);
        model.quats.push([1.0, 0.0, 0.0, 0.0]);
        model.opacities.push(random.random_range(-2.0..2.0));
        model.sh0.push(std::array::from_fn(|_| random.random_range(-1.0..1.0)));
        model.sh_rest.extend([[0.0_f32; 3]; 15]);
    }
    let focal = f64::from(width);
    let camera = Camera {
        rotation: DMat3::IDENTITY,
        translation: DVec3::new(0.0, 0.0, 3.0),
        fx: focal,
        fy: focal,
        cx: f64::from(width) / 2.0,
        cy: f64::from(height) / 2.0,
        width,
        height,
    };
    let pixels = (width * height) as usize;
    let photo = Photo { width, height, rgba: vec![[90, 120, 150, 255]; pixels] };
    let ids = (0..pixels).map(|index| 1 + (index % 2) as u16).collect();
    let view = View {
        name: "view".to_owned(),
        camera,
        photo: Some(photo.into()),
        mask: Some(LabelMap { width, height, ids }.into()),
    };
    (Dataset { train: vec![view], ..Dataset::default() }, model)
}

/// Returns a value of /proc/self/status, bytes.
fn resident(name: &str) -> Result<u64> {
    let problem = || Error::Bug(format!("/proc/self/status has no {name}"));
    let text = std::fs::read_to_string("/proc/self/status").map_err(|_| problem())?;
    let line = text.lines().find_map(|line| line.strip_prefix(name)).ok_or_else(problem)?;
    let kib: u64 = line.trim().trim_end_matches("kB").trim().parse().map_err(|_| problem())?;
    Ok(kib * 1024)
}
