//! One traversal for the scene and all sampled objects, against a pass for each as in the reference code of LabelGS.
//!
//! Both use the same kernels and the same culling ([`labelgs::internals::pass::separate_step`]), so their ratio is the
//! saving by the structure. Steps of both and of a plain training run in turn, from the same model, on the same views.
//!
//! In favour of separate passes: each culls to the object's Gaussians first, adds gradients for visible splats only,
//! and has its loss in the blend kernel. Against them: as in the reference, each pass visits all tiles of the image.

use super::measure::{self, Cost, median, median_cost, require, table, timed};
use super::trained::{Judge, labelled_model, start, timed_step, timing_config, trainer, without_masks};
use super::{Common, device};
use labelgs::Result;
use labelgs::eval::MeanScores;
use labelgs::gpu::Gpu;
use labelgs::internals::pass;
use labelgs::internals::pass::Variant;
use labelgs::internals::train::{StepReport, Trainer};
use labelgs::run::TrainConfig;
use labelgs::scene::{Dataset, Gaussians, View};
use labelgs::synth;
use labelgs::synth::{Preset, SynthOptions};
use serde::Serialize;
use std::sync::Arc;

/// Largest relative difference of the losses of two steps that should be equal: both modes start from one model, and
/// Adam amplifies rounding differences of small gradients.
const SAME_LOSS: f64 = 0.02;
/// Walked pairs that may differ for the same reason.
const SAME_PAIRS: f64 = 0.01;

/// Options of the comparison.
#[derive(clap::Args, Clone, Debug)]
pub struct Options {
    #[command(flatten)]
    common: Common,
    /// Steps of each mode that are timed.
    #[arg(long, value_name = "N", default_value_t = 60, value_parser = clap::value_parser!(u32).range(1..))]
    steps: u32,
    /// Steps of the common model that all modes start from.
    #[arg(long, value_name = "N", default_value_t = 1500)]
    from_step: u32,
    /// Steps of the trainings whose scores are compared; 0 leaves them out.
    #[arg(long, value_name = "N", default_value_t = 1000)]
    iterations: u32,
}

/// Sizes of a run.
struct Plan {
    scene: SynthOptions,
    /// Objects that a view needs to be timed.
    objects: usize,
    warm_up: u32,
    steps: u32,
    from_step: u32,
    iterations: u32,
}

impl Plan {
    fn new(options: &Options) -> Self {
        if options.common.small {
            let scene = SynthOptions {
                preset: Preset::Simple,
                width: 72,
                height: 52,
                views: 5,
                points: 300,
                seed: 3,
                ..SynthOptions::default()
            };
            return Self { scene, objects: 2, warm_up: 1, steps: 3, from_step: 30, iterations: 40 };
        }
        let scene = SynthOptions { preset: Preset::Hard, ..SynthOptions::default() };
        let (steps, from_step, iterations) = (options.steps, options.from_step, options.iterations);
        Self { scene, objects: 10, warm_up: 8, steps, from_step, iterations }
    }
}

/// Measurements of one way to do a step.
#[derive(Clone, Debug, Serialize)]
struct Mode {
    name: &'static str,
    /// Medians, ms.
    step_ms: f64,
    cpu_ms: f64,
    /// Items of the list: dispatches, fills and copies.
    items: usize,
    /// (pixel, splat) pairs that the forward pass walks, millions, median.
    mega_pairs: f64,
}

/// The written results.
#[derive(Debug, Serialize)]
struct Outcome {
    device: String,
    load: Option<f64>,
    size: (u32, u32),
    gaussians: u32,
    objects_per_step: f64,
    timed_steps: u32,
    modes: Vec<Mode>,
    /// Time of the separate mode over that of the engine, by wall clock and by processor time.
    speed_up: f64,
    speed_up_cpu: f64,
    /// Pairs of the object layers over those of the scene.
    object_pairs: f64,
    /// Cost of the labels beyond the plain step, processor time: separate mode over the engine.
    label_cost_ratio: f64,
    trainings: Vec<Training>,
}

/// Scores of a training on the held-out views.
#[derive(Clone, Debug, Serialize)]
struct Training {
    name: &'static str,
    seconds: f64,
    gaussians: u32,
    scores: MeanScores,
}

/// Runs it.
pub fn run(options: &Options) -> Result<()> {
    let plan = Plan::new(options);
    let gpu = device::open()?;
    let dataset = synth::dataset(&plan.scene, 5);
    let model = labelled_model(&gpu, &dataset, plan.from_step)?;
    let mut outcome = time(&gpu, &dataset, &model, &plan)?;
    print(&outcome);
    if plan.iterations > 0 {
        for (name, separate) in [("one traversal", false), ("a pass for each", true)] {
            outcome.trainings.push(train(&gpu, &dataset, &plan, name, separate)?);
        }
        print_trainings(&outcome.trainings, plan.iterations);
    }
    measure::write_json(&options.common.output.join("paper.json"), &outcome)?;
    check(&outcome, options.common.small)
}

/// Views with many objects, so that every timed step has as many as the paper samples.
fn crowded(dataset: &Dataset, objects: usize) -> Dataset {
    let many = |view: &View| view.mask.as_ref().is_some_and(|mask| mask.objects().len() >= objects);
    let mut crowded = dataset.clone();
    crowded.train.retain(many);
    crowded
}

fn time(gpu: &Arc<Gpu>, dataset: &Dataset, model: &Gaussians, plan: &Plan) -> Result<Outcome> {
    let crowd = crowded(dataset, plan.objects);
    require(!crowd.train.is_empty(), || format!("no view shows {} objects", plan.objects))?;
    // Every step has layers, the only passes that can run apart.
    let config = || TrainConfig { layer_every: Some(1), ..timing_config() };
    let mut trainers = [
        trainer(gpu, &without_masks(&crowd), model, config())?,
        trainer(gpu, &crowd, model, config())?,
        trainer(gpu, &crowd, model, config())?,
    ];
    trainers[2].separate_objects(true);
    let mut costs: [Vec<Cost>; 3] = Default::default();
    let mut reports: [Vec<StepReport>; 3] = Default::default();
    for step in 0..plan.warm_up + plan.steps {
        for (index, trainer) in trainers.iter_mut().enumerate() {
            let (done, cost) = timed_step(trainer)?;
            if step >= plan.warm_up {
                costs[index].push(cost);
                reports[index].extend(done);
            }
        }
        same(&reports[1], &reports[2])?;
    }
    let lists = lists(&mut trainers[1], plan.objects as u32);
    let pixels = f64::from(trainers[0].engine_mut().shape().tile_pixels());
    let names = ["plain step", "labels, one traversal", "labels, a pass for each"];
    let pairs: Vec<f64> = reports.iter().map(|reports| median_pairs(reports) * pixels / 1e6).collect();
    let mode = |index: usize| {
        let Cost { wall, cpu } = median_cost(&costs[index]);
        Mode { name: names[index], step_ms: wall, cpu_ms: cpu, items: lists[index], mega_pairs: pairs[index] }
    };
    let modes: Vec<Mode> = (0..3).map(mode).collect();
    let ratio = |of: fn(&Cost) -> f64| {
        let each = costs[2].iter().zip(&costs[1]).map(|(apart, together)| of(apart) / of(together));
        median(each)
    };
    let sampled = |view: &View| view.mask.as_ref().map_or(0, |mask| mask.objects().len()).min(10) as f64;
    Ok(Outcome {
        device: gpu.capabilities().name.clone(),
        load: measure::load(),
        size: (plan.scene.width, plan.scene.height),
        gaussians: trainers[1].gaussian_count(),
        objects_per_step: crowd.train.iter().map(sampled).sum::<f64>() / crowd.train.len() as f64,
        timed_steps: plan.steps,
        speed_up: ratio(|cost| cost.wall),
        speed_up_cpu: ratio(|cost| cost.cpu),
        object_pairs: pairs[1] / pairs[0] - 1.0,
        label_cost_ratio: (modes[2].cpu_ms - modes[0].cpu_ms) / (modes[1].cpu_ms - modes[0].cpu_ms),
        modes,
        trainings: Vec::new(),
    })
}

/// Checks that both modes do the same step.
fn same(together: &[StepReport], apart: &[StepReport]) -> Result<()> {
    let (Some(a), Some(b)) = (together.last(), apart.last()) else { return Ok(()) };
    let (walked_a, walked_b) = (a.report.counters.walked_splats() as f64, b.report.counters.walked_splats() as f64);
    let close = |a: f64, b: f64, most: f64| (a - b).abs() <= most * a.abs().max(1e-6);
    let holds = close(a.loss, b.loss, SAME_LOSS)
        && close(a.label_loss, b.label_loss, SAME_LOSS)
        && close(walked_a, walked_b, SAME_PAIRS);
    require(holds, || {
        format!(
            "step {}: losses {} and {}, of labels {} and {}, walked {walked_a} and {walked_b}",
            a.step, a.loss, b.loss, a.label_loss, b.label_loss
        )
    })
}

fn median_pairs(reports: &[StepReport]) -> f64 {
    median(reports.iter().map(|report| report.report.counters.walked_splats() as f64))
}

/// Items of the three lists.
fn lists(trainer: &mut Trainer, objects: u32) -> [usize; 3] {
    let engine = trainer.engine_mut();
    let (shape, capacity, size) = (engine.shape(), engine.raw().capacity(), engine.size().image);
    let variant = Variant { labels: true, ..Variant::plain(size) };
    let plain = pass::training_step(shape, capacity, Variant { labels: false, ..variant });
    let together = pass::training_step(shape, capacity, variant);
    let apart = pass::separate_step(shape, capacity, variant, objects);
    [plain.work.len(), together.work.len(), apart.work.len()]
}

fn train(gpu: &Arc<Gpu>, dataset: &Dataset, plan: &Plan, name: &'static str, separate: bool) -> Result<Training> {
    let config = TrainConfig {
        iterations: plan.iterations,
        label_from: Some(plan.iterations.div_ceil(3)),
        ..TrainConfig::paper()
    };
    let mut trainer = trainer(gpu, dataset, &start(dataset, &config)?, config.clone())?;
    trainer.separate_objects(separate);
    let ((), cost) = timed(|| {
        for _ in 0..plan.iterations {
            trainer.step()?;
        }
        trainer.drain().map(|_| ())
    })?;
    let model = trainer.labelled_model()?;
    let scores = Judge::new(gpu, dataset)?.scores(dataset, &model, &config)?;
    Ok(Training { name, seconds: cost.wall / 1e3, gaussians: model.len() as u32, scores })
}

fn print(outcome: &Outcome) {
    let (width, height) = outcome.size;
    let load = outcome.load.map_or(String::new(), |load| format!(", load {load:.1}"));
    println!(
        "{}{load}; {width} x {height} px, {} Gaussians, {:.1} objects a step, {} steps of each in turn\n",
        outcome.device, outcome.gaussians, outcome.objects_per_step, outcome.timed_steps
    );
    let mut rows = vec![["step", "ms", "CPU ms", "items", "Mpairs"].map(str::to_owned).to_vec()];
    for mode in &outcome.modes {
        let numbers = [format!("{:.1}", mode.step_ms), format!("{:.1}", mode.cpu_ms), mode.items.to_string()];
        let pairs = format!("{:.2}", mode.mega_pairs);
        rows.push([mode.name.to_owned()].into_iter().chain(numbers).chain([pairs]).collect());
    }
    println!("{}", table(&rows));
    println!(
        "one traversal is {:.2} times as fast (processor time: {:.2}); the labels alone {:.2} times",
        outcome.speed_up, outcome.speed_up_cpu, outcome.label_cost_ratio
    );
    println!("pairs of the objects are {:.2} of those of the scene\n", outcome.object_pairs);
}

fn print_trainings(trainings: &[Training], iterations: u32) {
    println!("{iterations} steps with the paper's settings, same seed, held-out views:");
    let head = ["mode", "s", "Gaussians", "PSNR", "SSIM", "IoU map", "IoU object"];
    let mut rows = vec![head.map(str::to_owned).to_vec()];
    for training in trainings {
        let number = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.3}"));
        let scores = &training.scores;
        rows.push(vec![
            training.name.to_owned(),
            format!("{:.1}", training.seconds),
            training.gaussians.to_string(),
            number(scores.psnr),
            number(scores.ssim),
            number(scores.objects.iou_map),
            number(scores.objects.iou_object),
        ]);
    }
    println!("{}", table(&rows));
}

fn check(outcome: &Outcome, small: bool) -> Result<()> {
    let [plain, together, apart] = &outcome.modes[..] else { return Ok(()) };
    require(outcome.speed_up.is_finite() && outcome.object_pairs > 0.0, || "a ratio makes no sense".to_owned())?;
    require(plain.items < together.items && together.items < apart.items, || "the lists make no sense".to_owned())?;
    require(small || outcome.speed_up_cpu > 1.0, || {
        format!("one traversal is {:.2} times as fast as many", outcome.speed_up_cpu)
    })?;
    if let [a, b] = &outcome.trainings[..] {
        let psnr = |training: &Training| training.scores.psnr.unwrap_or(f64::NAN);
        // Tiny scenes have few pixels to average over.
        let most = if small { 3.0 } else { 1.0 };
        require((psnr(a) - psnr(b)).abs() < most, || format!("PSNR {} and {}", psnr(a), psnr(b)))?;
    }
    Ok(())
}
