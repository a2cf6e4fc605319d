//! What a learned feature per Gaussian costs beside the plain scene: LangSplat learns 3 channels (of an autoencoder),
//! Gaussian Grouping 16, Feature 3DGS 512.
//!
//! The features are rendered in the same engine, over the tile lists that the scene's step has made anyway, some channels
//! at a time, with their gradient by the features. Left out are the gradient by the geometry through the features, the
//! optimiser of the features, the loss (a difference stands for it), and all networks: a lower bound for such methods.

mod check;
mod kernels;

use super::measure::{self, Cost, median, median_cost, require, table, timed};
use super::trained::{labelled_model, small_scene, timed_step, timing_config, trainer, without_masks};
use super::{Common, device};
use glam::DVec3;
use kernels::{Buffers, Channels, Kernels, step_with_features};
use labelgs::Result;
use labelgs::engine::{EngineSize, capacity, model, uniforms::view_uniforms};
use labelgs::gpu::Gpu;
use labelgs::pass::{KernelShape, Variant, training_step};
use labelgs::scene::{Dataset, Gaussians, View};
use labelgs::scheduler::plan::{Buf, Capacity, PlanOptions};
use labelgs::scheduler::{ListId, Scheduler, SchedulerOptions};
use labelgs::shaders::structs::{Counters, StepUniforms};
use labelgs::synth::{self, SynthOptions};
use serde::Serialize;
use std::sync::Arc;

/// Methods by their channels, with minutes of training that LabelGS prints for its table of speeds (one scene, 15,000
/// steps, RTX 3090); its own are [`LABELGS_MINUTES`].
const METHODS: [(&str, u32, f64); 3] =
    [("LangSplat", 3, 22.0), ("Gaussian Grouping", 16, 28.0), ("Feature 3DGS", 512, 443.0)];
/// The same for LabelGS.
const LABELGS_MINUTES: f64 = 20.0;

/// Options of the comparison.
#[derive(clap::Args, Clone, Debug)]
pub struct Options {
    #[command(flatten)]
    common: Common,
    /// Steps of each kind that are timed.
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..))]
    steps: u32,
    /// Steps of training before.
    #[arg(long, value_name = "N", default_value_t = 1500)]
    from_step: u32,
}

/// One row.
#[derive(Clone, Debug, Serialize)]
struct Row {
    name: String,
    channels: u32,
    /// Channels in one walk of the tiles.
    at_once: u32,
    step_ms: f64,
    cpu_ms: f64,
    /// Processor time over that of the plain steps that ran in turn with it.
    ratio: f64,
    /// Minutes in the paper's table.
    paper_minutes: Option<f64>,
}

#[derive(Debug, Serialize)]
struct Outcome {
    device: String,
    load: Option<f64>,
    size: (u32, u32),
    gaussians: usize,
    rows: Vec<Row>,
}

/// Runs it.
pub fn run(options: &Options) -> Result<()> {
    let small = options.common.small;
    let (scene, warm_up, steps, from_step) =
        if small { (small_scene(), 1, 2, 12) } else { (SynthOptions::default(), 4, options.steps, options.from_step) };
    let gpu = device::open()?;
    let dataset = synth::dataset(&scene, 5);
    let model = labelled_model(&gpu, &dataset, from_step)?;
    let kernels = Kernels::compile(&KernelShape::of(gpu.capabilities()))?;
    check::run(&gpu, &kernels)?;
    let (labelled, capacity) = labelled_row(&gpu, &dataset, &model, warm_up, steps)?;
    let ground = Ground { gpu: &gpu, kernels: &kernels, model: &model, capacity, size: (scene.width, scene.height) };
    let mut rows = vec![labelled];
    for (name, channels, minutes) in METHODS {
        let found = feature_row(&ground, &dataset, channels, steps)?;
        rows.push(Row { name: name.to_owned(), paper_minutes: Some(minutes), ..found });
    }
    let load = measure::load();
    let size = (scene.width, scene.height);
    let outcome = Outcome { device: gpu.capabilities().name.clone(), load, size, gaussians: model.len(), rows };
    print(&outcome);
    measure::write_json(&options.common.output.join("features.json"), &outcome)?;
    let sane = |row: &Row| row.ratio.is_finite() && (small || row.ratio > 1.0);
    require(outcome.rows.iter().all(sane), || "a step with more work takes less time".to_owned())
}

/// Our labels beside the plain step, in turn; and the memory that the views need.
fn labelled_row(
    gpu: &Arc<Gpu>,
    dataset: &Dataset,
    model: &Gaussians,
    warm_up: u32,
    steps: u32,
) -> Result<(Row, Capacity)> {
    let mut plain = trainer(gpu, &without_masks(dataset), model, timing_config())?;
    let mut labelled = trainer(gpu, dataset, model, timing_config())?;
    // Every view once, so that the buffers have grown.
    let warm_up = warm_up.max(dataset.train.len() as u32);
    let mut costs = [Vec::new(), Vec::new()];
    for step in 0..warm_up + steps {
        for (trainer, costs) in [&mut plain, &mut labelled].into_iter().zip(&mut costs) {
            let (_, cost) = timed_step(trainer)?;
            if step >= warm_up {
                costs.push(cost);
            }
        }
    }
    // As many rows as there are Gaussians, or 512 channels would not fit where they do.
    let grown = *plain.engine_mut().raw().capacity();
    let room = EngineSize { gaussians: model.len() as u64, ..*plain.engine_mut().room() };
    let exact = capacity(plain.engine_mut().shape(), &room);
    let capacity = Capacity { instances: grown.instances, trained_instances: grown.trained_instances, ..exact };
    Ok((row("labels (LabelGS, this engine)", &costs[1], &costs[0]), capacity))
}

fn row(name: &str, with: &[Cost], without: &[Cost]) -> Row {
    let Cost { wall, cpu } = median_cost(with);
    let ratio = median(with.iter().zip(without).map(|(with, without)| with.cpu / without.cpu));
    let paper_minutes = Some(LABELGS_MINUTES);
    Row { name: name.to_owned(), channels: 0, at_once: 0, step_ms: wall, cpu_ms: cpu, ratio, paper_minutes }
}

/// Plain steps and steps with features, in turn; the number of channels at a time that is fastest.
fn feature_row(ground: &Ground, dataset: &Dataset, count: u32, steps: u32) -> Result<Row> {
    let mut best: Option<(f64, Bed)> = None;
    for vecs in [1, 2, 4].into_iter().filter(|vecs| *vecs == 1 || 4 * vecs <= count) {
        let channels = Channels { count, vecs };
        let mut bed = Bed::new(ground, channels, true)?;
        let view = &dataset.train[0];
        bed.step(view, true)?;
        let mut times = Vec::new();
        for _ in 0..3 {
            times.push(timed(|| bed.step(view, true))?.1.cpu);
        }
        let time = median(times);
        if best.as_ref().is_none_or(|(least, _)| time < *least) {
            best = Some((time, bed));
        }
    }
    let Some((_, mut bed)) = best else { return Err(labelgs::Error::Bug("nothing was timed".to_owned())) };
    let (mut with, mut without) = (Vec::new(), Vec::new());
    bed.step(&dataset.train[0], false)?;
    for view in dataset.train.iter().cycle().take(steps as usize) {
        without.push(timed(|| bed.step(view, false))?.1);
        with.push(timed(|| bed.step(view, true))?.1);
    }
    let at_once = 4 * bed.channels.vecs;
    Ok(Row { channels: count, at_once, ..row("", &with, &without) })
}

/// What features are laid over.
struct Ground<'a> {
    gpu: &'a Arc<Gpu>,
    kernels: &'a Kernels,
    model: &'a Gaussians,
    /// Enough for every view.
    capacity: Capacity,
    /// Largest image, px.
    size: (u32, u32),
}

/// A model with features in an engine of their own.
struct Bed {
    sched: Scheduler,
    shape: KernelShape,
    buffers: Buffers,
    channels: Channels,
    gaussians: u32,
    plain: ListId,
    full: ListId,
    stamp: u32,
}

impl Bed {
    /// With `alias` scratch buffers share memory, without they can be read back.
    fn new(ground: &Ground, channels: Channels, alias: bool) -> Result<Self> {
        let Ground { gpu, kernels, model, capacity, size } = ground;
        require(capacity.segments == 1, || "a tile holds too many splats".to_owned())?;
        let shape = KernelShape::of(gpu.capabilities());
        let buffers = Buffers::new(channels, capacity)?;
        let plan = PlanOptions { alias, ..PlanOptions::default() };
        let options = SchedulerOptions { plan, ..SchedulerOptions::default() };
        let mut sched = Scheduler::new(Arc::clone(gpu), buffers.table, *capacity, options)?;
        model::upload(&mut sched, model, false)?;
        sched.upload(buffers.features, 0, 0, &features(model.len(), channels))?;
        let variant = Variant { labels: false, lift: false, sh_degree: 3, size: *size, update: true, counts: false };
        let full = step_with_features((&shape, capacity), variant, kernels, &buffers, channels)?;
        let full = sched.prepare(&full)?;
        let plain = sched.prepare(&training_step(&shape, capacity, variant))?;
        Ok(Self { sched, shape, buffers, channels, gaussians: model.len() as u32, plain, full, stamp: 0 })
    }

    /// One step on a view, which changes nothing but moments: rates are 0.
    fn step(&mut self, view: &View, with_features: bool) -> Result<Counters> {
        let Some(photo) = &view.photo else { return Err(labelgs::Error::Bug("no photo".to_owned())) };
        self.stamp += 1;
        let uniforms = StepUniforms {
            lambda_dssim: 0.2,
            loss_scale: 1.0 / (3.0 * photo.rgba.len() as f32),
            stamp: self.stamp,
            adam_correction1: 1.0,
            adam_correction2: 1.0,
            ..view_uniforms(&view.camera, DVec3::ZERO, &self.shape, 0.2, [0.0; 3], self.gaussians)
        };
        self.sched.upload(Buf::STEP, 0, 0, &[uniforms])?;
        self.sched.upload(Buf::TARGET, 0, 0, &photo.rgba)?;
        self.sched.run(if with_features { self.full } else { self.plain }, 0)?;
        let failure = self.sched.download::<u32>(Buf::REPORT_FAILURE, 0, 0, 1)?[0];
        require(failure == 0, || format!("a buffer was too small: {failure}"))?;
        Ok(self.sched.download::<Counters>(Buf::REPORT, 0, 0, 1)?[0])
    }
}

/// A feature that differs from Gaussian to Gaussian and from channel to channel, -1 to 1; 0 in channels of padding.
fn feature(gaussian: usize, channel: u32, channels: Channels) -> f32 {
    let word = (gaussian as u32).wrapping_mul(2_654_435_761).wrapping_add(channel.wrapping_mul(40_503)) >> 8;
    if channel < channels.count { word as f32 / (1 << 23) as f32 - 1.0 } else { 0.0 }
}

fn features(gaussians: usize, channels: Channels) -> Vec<f32> {
    let of = |gaussian| (0..4 * channels.stride()).map(move |channel| feature(gaussian, channel, channels));
    (0..gaussians).flat_map(of).collect()
}

fn print(outcome: &Outcome) {
    let (width, height) = outcome.size;
    let load = outcome.load.map_or(String::new(), |load| format!(", load {load:.1}"));
    println!("{}{load}; {width} x {height} px, {} Gaussians\n", outcome.device, outcome.gaussians);
    let head = [
        "beyond the plain scene",
        "channels",
        "at once",
        "ms",
        "CPU ms",
        "/ plain",
        "/ labels",
        "paper, min",
        "/ paper's",
    ];
    let mut rows = vec![head.map(str::to_owned).to_vec()];
    let labels = outcome.rows.first().map_or(f64::NAN, |row| row.ratio);
    for row in &outcome.rows {
        let some = |number: u32| if number > 0 { number.to_string() } else { "-".to_owned() };
        let minutes = |each: &dyn Fn(f64) -> String| row.paper_minutes.map_or("-".to_owned(), each);
        rows.push(vec![
            row.name.clone(),
            some(row.channels),
            some(row.at_once),
            format!("{:.1}", row.step_ms),
            format!("{:.1}", row.cpu_ms),
            format!("{:.2}", row.ratio),
            format!("{:.2}", row.ratio / labels),
            minutes(&|minutes| format!("{minutes:.0}")),
            minutes(&|minutes| format!("{:.2}", minutes / LABELGS_MINUTES)),
        ]);
    }
    println!("{}", table(&rows));
    println!(
        "/ plain: processor time over that of plain steps that ran in turn. Features: rendering and the gradient by the"
    );
    println!(
        "features alone, a lower bound for a step of such a method. The paper's minutes are whole trainings on its GPU.\n"
    );
}
