//! The result of `labelgs profile`, as a table and as JSON.

use crate::cli::commands::devices::{shape_json, shape_text};
use crate::cli::commands::profile::timed::TimedWork;
use crate::gpu::Gpu;
use crate::pass::{KernelShape, Stage};
use crate::scheduler::{Profiler, Traffic};
use crate::shaders::structs::Counters;
use crate::train::{LabelWork, StepReport, StepTimes};
use crate::words::counted;
use clap::Args;
use serde::Serialize;
use serde_json::{Value, json};
use std::collections::{BTreeMap, HashMap};
use std::time::Duration;

/// Threads of the host that run the passes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Workers {
    /// Number of threads.
    pub count: usize,
    /// Source of the number.
    pub source: &'static str,
}

/// Which steps are timed, and how.
#[derive(Args, Clone, Copy, Debug)]
pub struct Window {
    /// Number of steps to time.
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..))]
    pub steps: u32,
    /// Number of warm-up steps before timing.
    #[arg(long, value_name = "N", default_value_t = 20)]
    pub warm_up: u32,
    /// Train this many steps before timing. The timed steps then use full-size photos, the full degree of spherical
    /// harmonics and, with masks, labels, as at the end of a run.
    #[arg(long, value_name = "S", default_value_t = 0)]
    pub from_step: u32,
    /// Let passes overlap as in training. The time of a pass is then the time that it adds.
    #[arg(long)]
    pub overlap: bool,
}

/// Measurements of a training.
pub(crate) struct Measurement {
    /// Times of further steps by the clocks of the host.
    pub clocks: Clocks,
    /// Reports of the timed steps.
    pub reports: Vec<StepReport>,
    /// Times of their passes.
    pub times: Vec<StepTimes>,
    /// Reports of further, untimed steps, which count pairs with a weight.
    pub counted: Vec<StepReport>,
    /// Gaussians after the timed steps.
    pub gaussians: u32,
}

/// Times by the clocks of the host, of steps without timestamps, with several in flight.
pub(crate) struct Clocks {
    /// From the start of the first of them to the end of the last.
    pub wall: Duration,
    /// Each call of the trainer, which waits for an earlier step.
    pub steps: Vec<Duration>,
    /// CPU time of the process, if the system reports it.
    pub cpu: Option<Duration>,
    /// Bytes between host and device.
    pub traffic: Traffic,
}

/// Median, 90th percentile and mean.
#[derive(Clone, Copy, Debug, Serialize)]
struct Spread {
    median: f64,
    p90: f64,
    mean: f64,
}

/// A pass, or all passes of a stage.
#[derive(Serialize)]
struct Row {
    stage: &'static str,
    name: String,
    items: usize,
    median_ms: f64,
    p90_ms: f64,
    share: f64,
}

/// Time per (pixel, splat) pair walked, ns; on a software device, per worker thread.
#[derive(Serialize)]
struct PerPair {
    blend_forward: f64,
    blend_backward: f64,
}

/// Numbers of a step: name in JSON, name in the table, value by the report and the pixels of a tile.
const STEP_COUNTERS: [(&str, &str, fn(&StepReport, f64) -> f64); 7] = [
    ("visible", "visible splats", |step, _| f64::from(step.report.counters.visible_count)),
    ("instances", "(splat, tile) pairs", |step, _| f64::from(step.report.counters.instance_count)),
    ("layer_tiles", "tiles of object layers", |step, _| f64::from(step.report.counters.layer_tile_count)),
    ("longest_list", "splats of the fullest tile", |step, _| f64::from(step.report.counters.longest_list)),
    ("recounts", "partitions counted for late workgroups", |step, _| f64::from(step.report.counters.recount_count)),
    ("pairs_listed", "(pixel, splat) pairs listed", |step, pixels| {
        f64::from(step.report.counters.instance_count) * pixels
    }),
    ("pairs_walked", "(pixel, splat) pairs walked", |step, pixels| walked_splats(step) * pixels),
];

/// A profile, as in its JSON.
#[derive(Serialize)]
pub(crate) struct Profile {
    schema_version: u32,
    device: String,
    driver: String,
    kernels: Value,
    #[serde(skip)]
    shape: KernelShape,
    worker_threads: Option<usize>,
    worker_threads_from: Option<&'static str>,
    barrier_before_each_pass: bool,
    from_step: u32,
    warm_up: u32,
    labels: bool,
    views: usize,
    size: (u32, u32),
    sh_degree: Option<u32>,
    steps_with_layers: usize,
    steps_with_disagreement: usize,
    #[serde(skip)]
    timed: TimedWork,
    gaussians: u32,
    steps_counted: usize,
    stages: Vec<Row>,
    passes: Vec<Row>,
    passes_ms: Spread,
    pipeline_ms: Spread,
    processor_ms: Option<f64>,
    bytes_to_device: f64,
    bytes_from_device: f64,
    counters: BTreeMap<&'static str, Spread>,
    pairs_walked: f64,
    contributing_share: f64,
    /// Splats that subgroups of workgroup blends do not skip, over those that they test.
    hit_share: Option<f64>,
    balance_of_halves: f64,
    ns_per_pair: PerPair,
    steps: Vec<Value>,
}

impl Profile {
    /// Makes a profile of steps on `views` views. The times of a recording's first run, in which drivers compile, are
    /// left out.
    pub(crate) fn new(gpu: &Gpu, workers: Option<Workers>, window: Window, views: usize, found: Measurement) -> Self {
        let Measurement { clocks, reports, mut times, counted, gaussians } = found;
        let (device, shape) = (gpu.capabilities(), KernelShape::for_device(gpu.capabilities()));
        let pixels = f64::from(shape.tile_pixels());
        let of_step = |report: &StepReport| step_json(report, times.iter().find(|t| t.step == report.step), pixels);
        let steps: Vec<Value> = reports.iter().map(of_step).collect();
        let all = times.len();
        times.retain(|times| !times.is_first);
        let (timed, is_timed) = (TimedWork::new(&reports), |step| times.iter().any(|times| times.step == step));
        let pairs_walked: f64 =
            reports.iter().filter(|report| is_timed(report.step)).map(|step| walked_splats(step) * pixels).sum();
        let threads = workers.map_or(1.0, |workers| workers.count as f64);
        let per_pair = |stage| {
            let items = times.iter().flat_map(|times| &times.items).filter(|item| item.0 == stage);
            items.map(|item| item.2 as f64).sum::<f64>() * threads / pairs_walked
        };
        let sum =
            |of: fn(&Counters) -> u32| counted.iter().map(|step| f64::from(of(&step.report.counters))).sum::<f64>();
        let (weighted, tested) = (sum(|counters| counters.contributing_pairs), sum(|counters| counters.tested_splats));
        let counter = |value: fn(&StepReport, f64) -> f64| spread(reports.iter().map(|step| value(step, pixels)));
        let each = clocks.steps.len().max(1) as f64;
        let mean = clocks.wall.as_secs_f64() * 1e3 / each;
        Self {
            schema_version: 1,
            device: device.name.clone(),
            driver: format!("{} {}", device.driver_name, device.driver_info),
            kernels: shape_json(&shape),
            shape,
            worker_threads: workers.map(|workers| workers.count),
            worker_threads_from: workers.map(|workers| workers.source),
            barrier_before_each_pass: !window.overlap,
            from_step: window.from_step,
            warm_up: window.warm_up,
            labels: timed.layers + timed.disagreement > 0,
            views,
            size: timed.size(),
            sh_degree: timed.degrees.last().copied(),
            steps_with_layers: timed.layers,
            steps_with_disagreement: timed.disagreement,
            timed,
            gaussians,
            steps_counted: steps.len() - (all - times.len()),
            stages: rows(&times, |_| ""),
            passes: rows(&times, |name| name),
            passes_ms: spread(times.iter().map(|times| times.items.iter().map(|item| ms(item.2)).sum())),
            pipeline_ms: Spread { mean, ..spread(clocks.steps.iter().map(|time| time.as_secs_f64() * 1e3)) },
            bytes_to_device: clocks.traffic.up as f64 / each,
            bytes_from_device: clocks.traffic.down as f64 / each,
            processor_ms: clocks.cpu.map(|time| time.as_secs_f64() * 1e3 / each),
            counters: STEP_COUNTERS.iter().map(|&(name, _, value)| (name, counter(value))).collect(),
            pairs_walked,
            contributing_share: weighted / (counted.iter().map(walked_splats).sum::<f64>() * pixels),
            hit_share: (tested > 0.0).then(|| sum(|counters| counters.hit_splats) / tested),
            balance_of_halves: spread(reports.iter().map(balance)).mean,
            ns_per_pair: PerPair {
                blend_forward: per_pair(Stage::BLEND_FORWARD),
                blend_backward: per_pair(Stage::BLEND_BACKWARD),
            },
            steps,
        }
    }

    /// Returns the profile as a table.
    pub(crate) fn to_text(&self) -> String {
        let before = self.from_step + self.warm_up;
        let mut text = format!(
            "device:  {} ({})\nkernels: {}\nsteps {} to {} of a training: {}\n{}, {} at the end; \
             pass times from {}, without {} first runs of a recording; \
             {}\n\n",
            self.device,
            self.driver,
            shape_text(&self.shape),
            before + 1,
            before + self.steps.len() as u32,
            self.timed.to_text(),
            counted(self.views, "view"),
            counted(self.gaussians, "Gaussian"),
            counted(self.steps_counted, "step"),
            self.steps.len() - self.steps_counted,
            if self.barrier_before_each_pass { "a barrier before each pass" } else { "passes overlap" }
        );
        text +=
            &format!("{:<34} {:>5} {:>10} {:>10} {:>7}\n", "stage and pass", "items", "median ms", "p90 ms", "share");
        for sum in &self.stages {
            text += &line(sum.stage, sum);
            for pass in self.passes.iter().filter(|pass| pass.stage == sum.stage) {
                text += &line(&format!("  {}", pass.name), pass);
            }
        }
        text += &format!("\n{:<34} {:>16} {:>10} {:>10}\n", "per step", "median", "p90", "mean");
        text += &spread_line("sum of pass timestamps, ms", self.passes_ms, 3);
        text += &spread_line("host clock, steps in flight, ms", self.pipeline_ms, 3);
        if let Some(cpu) = self.processor_ms {
            text += &format!("{:<34} {:>16} {:>10} {cpu:>10.3}\n", "CPU time, all threads, ms", "", "");
        }
        let moved = [("bytes to the device", self.bytes_to_device), ("bytes from the device", self.bytes_from_device)];
        moved.iter().for_each(|(name, bytes)| text += &format!("{name:<34} {:>16} {:>10} {bytes:>10.0}\n", "", ""));
        STEP_COUNTERS.iter().for_each(|(key, name, _)| text += &spread_line(name, self.counters[key], 0));
        text + "\n" + &self.per_pair_text()
    }

    fn per_pair_text(&self) -> String {
        let PerPair { blend_forward, blend_backward } = self.ns_per_pair;
        let whose = match self.worker_threads.zip(self.worker_threads_from) {
            Some((count, source)) => format!("times {count} worker threads ({source})"),
            None => "of the whole device".to_owned(),
        };
        format!(
            "per (pixel, splat) pair walked, ns: blend forward {blend_forward:.3}, blend backward {blend_backward:.3}, \
             {whose}\n\
             pairs walked per pixel: {:.1}, of which {:.1} % contribute; the busier half of the tiles walks {:.3} \
             times the mean\n",
            self.counters["pairs_walked"].mean / self.timed.pixels,
            self.contributing_share * 100.0,
            self.balance_of_halves
        ) + &self.hit_share.map_or_else(String::new, |share| {
            format!("subgroups process {:.1} % of the splats that they test\n", share * 100.0)
        })
    }
}

fn step_json(report: &StepReport, times: Option<&StepTimes>, pixels: f64) -> Value {
    let counters = &report.report.counters;
    let mut stages: HashMap<&str, f64> = HashMap::new();
    for (stage, _, ns) in times.iter().flat_map(|times| &times.items) {
        *stages.entry(stage.name).or_default() += ms(*ns);
    }
    json!({
        "step": report.step,
        "size": report.kind.size,
        "sh_degree": report.kind.sh_degree,
        "labels": match report.kind.labels {
            LabelWork::None => "none",
            LabelWork::Disagreement => "disagreement",
            LabelWork::Layers => "layers",
        },
        "loss": report.loss,
        "label_loss": report.label_loss,
        "visible": counters.visible_count,
        "instances": counters.instance_count,
        "layer_tiles": counters.layer_tile_count,
        "longest_list": counters.longest_list,
        "pairs_walked": walked_splats(report) * pixels,
        "balance_of_halves": balance(report),
        "first_run": times.map(|times| times.is_first),
        "stages_ms": stages,
    })
}

fn walked_splats(step: &StepReport) -> f64 {
    step.report.counters.walked_splats() as f64
}

/// Returns the pairs walked by the busier half of the workgroups over the mean of both halves: 1 is even, 2 is all in
/// one half.
fn balance(step: &StepReport) -> f64 {
    let counters = &step.report.counters;
    f64::from(counters.walked_first.max(counters.walked_second)) / (0.5 * walked_splats(step)).max(1.0)
}

fn ms(ns: u64) -> f64 {
    ns as f64 / 1e6
}

/// Returns rows by stage and by `label` of an item's name, in the order of the step.
fn rows(times: &[StepTimes], label: impl Fn(&str) -> &str) -> Vec<Row> {
    let mut profiler = Profiler::with_warm_up(0);
    let mut named: HashMap<String, (Stage, String)> = HashMap::new();
    for times in times {
        let items = times.items.iter().map(|(stage, name, ns)| {
            let name = label(name);
            let key = format!("{}: {name}", stage.name);
            named.entry(key.clone()).or_insert_with(|| (*stage, name.to_owned()));
            (key, *ns)
        });
        profiler.add(&items.collect::<Vec<_>>());
    }
    let rows = profiler.rows().into_iter().filter_map(|row| {
        let (stage, name) = named.get(&row.label)?.clone();
        let (median_ms, p90_ms) = (ms(row.median), ms(row.p90));
        Some((stage, Row { stage: stage.name, name, items: row.items, median_ms, p90_ms, share: row.share }))
    });
    let mut rows: Vec<(Stage, Row)> = rows.collect();
    rows.sort_by_key(|(stage, _)| *stage);
    rows.into_iter().map(|(_, row)| row).collect()
}

fn spread(values: impl Iterator<Item = f64>) -> Spread {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    let at = |percent: usize| values.get(values.len().saturating_sub(1) * percent / 100).copied().unwrap_or(f64::NAN);
    Spread { median: at(50), p90: at(90), mean: values.iter().sum::<f64>() / values.len().max(1) as f64 }
}

fn line(name: &str, Row { items, median_ms, p90_ms, share, .. }: &Row) -> String {
    format!("{name:<34} {items:>5} {median_ms:>10.3} {p90_ms:>10.3} {:>6.1}%\n", share * 100.0)
}

fn spread_line(name: &str, values: Spread, digits: usize) -> String {
    format!("{name:<34} {:>16.digits$} {:>10.digits$} {:>10.digits$}\n", values.median, values.p90, values.mean)
}
