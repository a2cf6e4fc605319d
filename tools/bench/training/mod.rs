//! Quality against seconds of training: plain, with our labels, with the paper's settings, and with the paper's
//! settings and a pass for each object.
//!
//! The clock starts with the scene in memory and an open device, before the model is on it, and stands still while
//! models are scored. What a driver compiles is in it; the time to the first step is measured on its own, in new
//! processes with empty and with filled caches.

mod against;
mod chart;
mod curve;
mod ladder;
mod rows;

use super::measure::{self, median, require, table};
use super::trained::{Judge, small_scene, start, trainer, without_masks};
use super::{Common, device};
pub use against::scene_of;
use curve::{Curve, Sample, reached};
use labelgs::gpu::{Gpu, GpuOptions, PipelineStore};
use labelgs::records::PipelineFolder;
use labelgs::run::TrainConfig;
use labelgs::scene::Dataset;
use labelgs::synth;
use labelgs::synth::SynthOptions;
use labelgs::{Error, Result};
pub use rows::{Plan, Row, Rows, SceneOf, program};
use serde::Serialize;
use std::process::Command;
use std::sync::Arc;
use std::time::Instant;

/// Tolerances within which a reference quality counts as met: PSNR (dB), and IoU.
const NEAR: (f64, f64) = (0.1, 0.01);

/// Options of the comparison.
#[derive(clap::Args, Clone, Debug)]
pub struct Options {
    #[command(flatten)]
    common: Common,
    /// Steps of each training.
    #[arg(long, value_name = "N", default_value_t = 3000, value_parser = clap::value_parser!(u32).range(4..))]
    iterations: u32,
    /// Seeds, each a training of every kind.
    #[arg(long, value_name = "SEED,SEED", value_delimiter = ',', default_values_t = [0, 1, 2])]
    seeds: Vec<u64>,
    #[command(flatten)]
    against: against::Against,
}

/// A kind of training.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Kind {
    name: &'static str,
    labels: bool,
    paper: bool,
    separate: bool,
}

const KINDS: [Kind; 4] = [
    Kind { name: "no labels", labels: false, paper: false, separate: false },
    Kind { name: "labels", labels: true, paper: false, separate: false },
    Kind { name: "paper's settings", labels: true, paper: true, separate: false },
    Kind { name: "paper's, a pass for each object", labels: true, paper: true, separate: true },
];

/// Seconds from the start of a process to its first finished step.
#[derive(Clone, Copy, Debug, Serialize)]
struct Start {
    /// With empty caches of the driver and of the program.
    cold: f64,
    /// With both filled by the run before.
    warm: f64,
}

#[derive(Debug, Serialize)]
struct Outcome {
    device: String,
    load: Option<f64>,
    size: (u32, u32),
    views: usize,
    iterations: u32,
    start: Start,
    /// PSNR of the plain training at its end and IoU of the labelled one, medians over seeds.
    reference: (f64, f64),
    curves: Vec<Curve>,
}

/// Runs it.
pub fn run(options: &Options) -> Result<()> {
    let small = options.common.small;
    if let Some(file) = &options.against.rows {
        if !file.is_file() {
            return Err(Error::usage("rows", format!("there is no file {}", file.display())));
        }
        return against::show(&rows::Rows::open(file)?.rows, &options.common.output);
    }
    if let Some(other) = &options.against.against {
        return against::run(other, &options.against, &options.seeds, &options.common);
    }
    let scene = scene(small);
    let (iterations, seeds) = if small { (60, vec![0, 1]) } else { (options.iterations, options.seeds.clone()) };
    require(!seeds.is_empty(), || "no seed is given".to_owned())?;
    let gpu = device::open()?;
    let dataset = synth::dataset(&scene, 8);
    let start = starts(small)?;
    println!("first step after {:.2} s with empty caches, {:.2} s with filled ones\n", start.cold, start.warm);
    let mut curves = Vec::new();
    for seed in seeds {
        for kind in KINDS {
            let curve = train(&gpu, &dataset, kind, iterations, seed, small)?;
            println!("{}, seed {seed}: {}", kind.name, curve.last());
            curves.push(curve);
        }
    }
    let last = |name: &str, of: fn(&Sample) -> Option<f64>| {
        let of_kind = curves.iter().filter(|curve| curve.kind == name);
        median(of_kind.filter_map(|curve| of(curve.samples.last()?)))
    };
    let reference = (last(KINDS[0].name, |s| s.psnr), last(KINDS[1].name, |s| s.iou_map));
    let outcome = Outcome {
        device: gpu.capabilities().name.clone(),
        load: measure::load(),
        size: (scene.width, scene.height),
        views: dataset.train.len(),
        iterations,
        start,
        reference,
        curves,
    };
    print(&outcome);
    measure::write_json(&options.common.output.join("training.json"), &outcome)?;
    chart::write(&options.common.output.join("training.svg"), &outcome.curves)?;
    check(&outcome)
}

fn scene(small: bool) -> SynthOptions {
    if small { SynthOptions { views: 6, ..small_scene() } } else { SynthOptions::default() }
}

fn config(kind: Kind, iterations: u32, seed: u64) -> TrainConfig {
    let base = if kind.paper { TrainConfig::paper() } else { TrainConfig::default() };
    // Short runs let labels in after a third of their steps, as a run of 3,000 does after 1,000.
    let label_from = Some(base.labels_from().min(iterations.div_ceil(3)));
    TrainConfig { iterations, seed, label_from, ..base }
}

fn train(gpu: &Arc<Gpu>, dataset: &Dataset, kind: Kind, iterations: u32, seed: u64, small: bool) -> Result<Curve> {
    let config = config(kind, iterations, seed);
    let scene = if kind.labels { dataset.clone() } else { without_masks(dataset) };
    let mut judge = Judge::new(gpu, dataset)?;
    let mut curve = Curve { kind: kind.name, seed, samples: Vec::new(), scoring_seconds: 0.0 };
    let mut marks = curve::marks(if small { 0.01 } else { 1.0 });
    let mut mark = marks.next();
    let (mut before, mut now) = (0.0, Instant::now());
    let mut trainer = trainer(gpu, &scene, &start(&scene, &config)?, config.clone())?;
    trainer.separate_objects(kind.separate);
    for step in 1..=iterations {
        trainer.step()?;
        let due = mark.is_some_and(|mark| before + now.elapsed().as_secs_f64() >= mark);
        if !due && step < iterations {
            continue;
        }
        trainer.drain()?;
        before += now.elapsed().as_secs_f64();
        while mark.is_some_and(|mark| mark <= before) {
            mark = marks.next();
        }
        let pause = Instant::now();
        let gaussians = trainer.gaussian_count();
        let mut model = if step < config.labels_from() { trainer.model()? } else { trainer.labelled_model()? };
        model.labels = model.labels.filter(|_| kind.labels);
        let scores = judge.scores(dataset, &model, &config)?;
        curve.samples.push(Sample {
            seconds: before,
            step,
            gaussians,
            psnr: scores.psnr,
            ssim: scores.ssim,
            iou_map: scores.objects.iou_map.filter(|_| kind.labels),
            iou_object: scores.objects.iou_object.filter(|_| kind.labels),
        });
        curve.scoring_seconds += pause.elapsed().as_secs_f64();
        now = Instant::now();
    }
    Ok(curve)
}

/// Runs the first step in two new processes, with caches of their own.
fn starts(small: bool) -> Result<Start> {
    let program = std::env::current_exe().map_err(Error::read("the program"))?;
    let caches = tempfile::tempdir().map_err(Error::write("a folder for caches"))?;
    let run = || -> Result<f64> {
        let mut child = Command::new(&program);
        child.args(if small { &["first-step", "--small"][..] } else { &["first-step"] });
        child.env("MESA_SHADER_CACHE_DIR", caches.path().join("mesa"));
        child.env("LABELGS_CACHE", caches.path().join("labelgs"));
        let output = child.output().map_err(Error::read(&program))?;
        let text = String::from_utf8_lossy(&output.stdout).trim().to_owned();
        let problem = || Error::Check(format!("the first step failed: {}", String::from_utf8_lossy(&output.stderr)));
        if output.status.success() { text.parse().map_err(|_| problem()) } else { Err(problem()) }
    };
    Ok(Start { cold: run()?, warm: run()? })
}

/// The hidden command behind [`starts`]: prints the seconds from here to the end of a labelled step.
pub fn first_step(common: &Common) -> Result<()> {
    let dataset = synth::dataset(&scene(common.small), 8);
    let config = TrainConfig { label_from: Some(1), ..TrainConfig::default() };
    let model = start(&dataset, &config)?;
    let begin = Instant::now();
    let mut options = GpuOptions::from_env()?;
    options.pipelines = PipelineFolder::of_user().map(|folder| Arc::new(folder) as Arc<dyn PipelineStore>);
    let gpu = Gpu::new(&options)?;
    let mut trainer = trainer(&gpu, &dataset, &model, config)?;
    trainer.step()?;
    trainer.drain()?;
    println!("{}", begin.elapsed().as_secs_f64());
    Ok(())
}

fn print(outcome: &Outcome) {
    let (width, height) = outcome.size;
    let load = outcome.load.map_or(String::new(), |load| format!(", load {load:.1}"));
    println!(
        "\n{}{load}; {width} x {height} px, {} views, {} steps",
        outcome.device, outcome.views, outcome.iterations
    );
    let scoring: f64 = outcome.curves.iter().map(|curve| curve.scoring_seconds).sum();
    println!("scoring, {scoring:.0} s in all, is not counted; medians over seeds, (least to most)\n");
    let head = ["training", "s", "Gaussians", "PSNR", "SSIM", "IoU map", "IoU object"];
    let mut rows = vec![head.map(str::to_owned).to_vec()];
    let (psnr, iou) = outcome.reference;
    let to_psnr = format!("s to {:.2} dB", psnr - NEAR.0);
    let to_iou = format!("s to IoU {:.3}", iou - NEAR.1);
    rows[0].extend([to_psnr, to_iou]);
    for kind in KINDS {
        let curves: Vec<&Curve> = outcome.curves.iter().filter(|curve| curve.kind == kind.name).collect();
        let ends: Vec<&Sample> = curves.iter().filter_map(|curve| curve.samples.last()).collect();
        let cell = |digits: usize, of: &dyn Fn(&Sample) -> Option<f64>| spread(ends.iter().map(|s| of(s)), digits);
        let times = |of: fn(&Sample) -> Option<f64>, least: f64| {
            spread(curves.iter().map(|curve| reached(&curve.samples, of, least)), 1)
        };
        rows.push(vec![
            kind.name.to_owned(),
            cell(1, &|s| Some(s.seconds)),
            cell(0, &|s| Some(f64::from(s.gaussians))),
            cell(2, &|s| s.psnr),
            cell(4, &|s| s.ssim),
            cell(3, &|s| s.iou_map),
            cell(3, &|s| s.iou_object),
            times(|s| s.psnr, psnr - NEAR.0),
            times(|s| s.iou_map, iou - NEAR.1),
        ]);
    }
    println!("{}", table(&rows));
}

/// Median and range; "-" where a seed has no value.
fn spread(values: impl Iterator<Item = Option<f64>>, digits: usize) -> String {
    let Some(values) = values.collect::<Option<Vec<f64>>>().filter(|values| !values.is_empty()) else {
        return "-".to_owned();
    };
    let least = values.iter().copied().fold(f64::INFINITY, f64::min);
    let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let middle = median(values.iter().copied());
    if values.len() == 1 {
        return format!("{middle:.digits$}");
    }
    format!("{middle:.digits$} ({least:.digits$} to {most:.digits$})")
}

fn check(outcome: &Outcome) -> Result<()> {
    for curve in &outcome.curves {
        let end = curve.samples.last();
        let psnr = end.and_then(|sample| sample.psnr).unwrap_or(f64::NAN);
        require(psnr.is_finite() && psnr > 5.0, || format!("{}: PSNR {psnr}", curve.kind))?;
        let rises = curve.samples.windows(2).all(|pair| pair[0].seconds <= pair[1].seconds);
        require(rises, || format!("{}: time goes back", curve.kind))?;
    }
    let start = outcome.start;
    require(start.cold > 0.0 && start.warm > 0.0, || "a start took no time".to_owned())
}

/// Used by the chart: colours and names in the order of the table.
fn names() -> impl Iterator<Item = &'static str> {
    KINDS.iter().map(|kind| kind.name)
}
