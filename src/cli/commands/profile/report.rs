//! The result of `labelgs profile`, as a table and as JSON.

use crate::cli::commands::devices::{shape_json, shape_of, shape_text};
use crate::cli::commands::profile::timed::Timed;
use crate::gpu::Gpu;
use crate::pass::{KernelShape, Stage};
use crate::scheduler::{PassTime, Profiler};
use crate::train::{LabelWork, StepReport, StepTimes};
use crate::words::counted;
use serde_json::{Value, json};
use std::collections::{HashMap, HashSet};
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
#[derive(Clone, Copy, Debug)]
pub(crate) struct Window {
    /// True if passes overlap as in training.
    pub overlap: bool,
    /// Steps of training before the warm-up.
    pub from_step: u32,
    /// Steps of the warm-up; their times do not count.
    pub warm_up: u32,
    /// Steps that are timed.
    pub steps: u32,
}

/// Times by the clocks of the host.
#[derive(Clone, Debug, Default)]
pub(crate) struct Clocks {
    /// From the start of the first timed step to the end of the last.
    pub wall: Duration,
    /// Each call of the trainer. Two steps are in flight, so a call waits for an earlier step.
    pub steps: Vec<Duration>,
    /// Processor time of the process, if the system reports it.
    pub cpu: Option<Duration>,
}

/// Median, 90th percentile and mean.
#[derive(Clone, Copy, Debug, Default)]
struct Spread {
    median: f64,
    p90: f64,
    mean: f64,
}

/// A profile.
pub(crate) struct Profile {
    device: String,
    driver: String,
    shape: KernelShape,
    workers: Option<Workers>,
    overlap: bool,
    from_step: u32,
    warm_up: u32,
    /// Training views.
    pub views: usize,
    /// Gaussians at the end.
    pub gaussians: u32,
    timed: Timed,
    clocks: Clocks,
    passes: Vec<(Stage, PassTime)>,
    stages: Vec<(Stage, PassTime)>,
    device_ms: Spread,
    /// Name in JSON, name in the table, values.
    counters: Vec<(&'static str, &'static str, Spread)>,
    pairs: f64,
    balance: f64,
    contributing: f64,
    ns_per_pair: [f64; 2],
    steps: Vec<Value>,
    left_out: usize,
}

impl Profile {
    /// Returns an empty profile.
    pub(crate) fn new(gpu: &Gpu, workers: Option<Workers>, window: Window) -> Self {
        let found = gpu.capabilities();
        Self {
            device: found.name.clone(),
            driver: format!("{} {}", found.driver_name, found.driver_info),
            shape: shape_of(found),
            workers,
            overlap: window.overlap,
            from_step: window.from_step,
            warm_up: window.warm_up,
            views: 0,
            gaussians: 0,
            timed: Timed::default(),
            clocks: Clocks::default(),
            passes: Vec::new(),
            stages: Vec::new(),
            device_ms: Spread::default(),
            counters: Vec::new(),
            pairs: 0.0,
            balance: f64::NAN,
            contributing: f64::NAN,
            ns_per_pair: [f64::NAN; 2],
            steps: Vec::new(),
            left_out: 0,
        }
    }

    /// Adds the measurements. The times of a recording's first run, in which drivers compile, are left out.
    pub(crate) fn fill(&mut self, clocks: Clocks, reports: &[StepReport], mut times: Vec<StepTimes>) {
        let all = times.len();
        self.steps =
            reports.iter().map(|report| self.step_json(report, times.iter().find(|t| t.step == report.step))).collect();
        times.retain(|times| !times.is_first);
        self.left_out = all - times.len();
        self.clocks = clocks;
        self.timed = Timed::new(reports);
        self.passes = rows(&times, |name| name);
        self.stages = rows(&times, |_| "");
        let sums = times.iter().map(|times| times.items.iter().map(|item| item.2 as f64 / 1e6).sum());
        self.device_ms = spread(sums.collect());
        let pixels = f64::from(self.shape.tile_pixels());
        let walked = |step: &StepReport| walked_splats(step) * pixels;
        let counter = |value: &dyn Fn(&StepReport) -> f64| spread(reports.iter().map(value).collect());
        self.counters = vec![
            ("visible", "visible splats", counter(&|step| f64::from(step.report.counters.visible_count))),
            ("instances", "(splat, tile) pairs", counter(&instances)),
            (
                "layer_tiles",
                "tiles of object layers",
                counter(&|step| f64::from(step.report.counters.layer_tile_count)),
            ),
            (
                "longest_list",
                "splats of the fullest tile",
                counter(&|step| f64::from(step.report.counters.longest_list)),
            ),
            ("pairs_listed", "(pixel, splat) pairs listed", counter(&|step| instances(step) * pixels)),
            ("pairs_walked", "(pixel, splat) pairs walked", counter(&walked)),
        ];
        self.balance = spread(reports.iter().map(balance).collect()).mean;
        let counted: HashSet<u32> = times.iter().map(|times| times.step).collect();
        self.pairs = reports.iter().filter(|report| counted.contains(&report.step)).map(walked).sum();
        let threads = self.workers.map_or(1.0, |workers| workers.count as f64);
        self.ns_per_pair = [Stage::BLEND_FORWARD, Stage::BLEND_BACKWARD].map(|stage| {
            let items = times.iter().flat_map(|times| &times.items).filter(|item| item.0 == stage);
            items.map(|item| item.2 as f64).sum::<f64>() * threads / self.pairs
        });
    }

    /// Adds the counts of further, untimed steps: the share of the walked pairs with a weight.
    pub(crate) fn fill_pairs(&mut self, reports: &[StepReport]) {
        let weighted: f64 = reports.iter().map(|step| f64::from(step.report.counters.contributing_pairs)).sum();
        let walked: f64 = reports.iter().map(walked_splats).sum();
        self.contributing = weighted / (walked * f64::from(self.shape.tile_pixels()));
    }

    /// Returns the number of steps that count for the passes.
    fn counted(&self) -> usize {
        self.steps.len() - self.left_out
    }

    fn host_ms(&self) -> Spread {
        let mut found = spread(self.clocks.steps.iter().map(|time| time.as_secs_f64() * 1e3).collect());
        found.mean = self.clocks.wall.as_secs_f64() * 1e3 / self.clocks.steps.len().max(1) as f64;
        found
    }

    fn cpu_ms(&self) -> Option<f64> {
        self.clocks.cpu.map(|time| time.as_secs_f64() * 1e3 / self.clocks.steps.len().max(1) as f64)
    }

    /// Returns the time per pair as text; on a software device, per worker thread.
    fn per_pair_text(&self) -> String {
        let [forward, backward] = self.ns_per_pair;
        let whose = match self.workers {
            Some(Workers { count, source }) => format!("times {count} worker threads ({source})"),
            None => "of the whole device".to_owned(),
        };
        let walked =
            self.counters.iter().find(|(name, _, _)| *name == "pairs_walked").map_or(f64::NAN, |(_, _, v)| v.mean);
        format!(
            "per (pixel, splat) pair walked, ns: blend forward {forward:.3}, blend backward {backward:.3}, {whose}\n\
             pairs walked per pixel: {:.1}, of which {:.1} % have a weight; the fuller half of the tiles walks {:.3} of \
             the mean\n",
            walked / self.timed.pixels,
            self.contributing * 100.0,
            self.balance
        )
    }

    /// Returns the profile as a table.
    pub(crate) fn to_text(&self) -> String {
        let (first, last) =
            (self.from_step + self.warm_up + 1, self.from_step + self.warm_up + self.steps.len() as u32);
        let mode = if self.overlap { "passes overlap" } else { "a barrier before each pass" };
        let mut text = format!(
            "device:  {} ({})\nkernels: {}\nsteps {first} to {last} of a training: {}\n{}, {} at the end; \
             {} count for the passes, {} first runs of a recording do not; \
             {mode}\n\n",
            self.device,
            self.driver,
            shape_text(&self.shape),
            self.timed.to_text(),
            counted(self.views, "view"),
            counted(self.gaussians, "Gaussian"),
            counted(self.counted(), "step"),
            self.left_out
        );
        text +=
            &format!("{:<34} {:>5} {:>10} {:>10} {:>7}\n", "stage and pass", "items", "median ms", "p90 ms", "share");
        for (stage, sum) in &self.stages {
            text += &line(stage.name, sum);
            for (_, pass) in self.passes.iter().filter(|(of, _)| of == stage) {
                text += &line(&format!("  {}", pass.label), pass);
            }
        }
        text += &format!("\n{:<34} {:>16} {:>10} {:>10}\n", "per step", "median", "p90", "mean");
        text += &spread_line("passes, ms", self.device_ms, 3);
        text += &spread_line("host's clock, ms", self.host_ms(), 3);
        if let Some(cpu) = self.cpu_ms() {
            text += &format!("{:<34} {:>16} {:>10} {cpu:>10.3}\n", "processor time, all threads, ms", "", "");
        }
        self.counters.iter().for_each(|(_, name, values)| text += &spread_line(name, *values, 0));
        text + "\n" + &self.per_pair_text()
    }

    /// Returns the profile as JSON.
    pub(crate) fn to_json(&self) -> Value {
        let row = |(stage, pass): &(Stage, PassTime)| {
            json!({
                "stage": stage.name, "name": pass.label, "items": pass.items, "median_ms": ms(pass.median),
                "p90_ms": ms(pass.p90), "share": pass.share,
            })
        };
        let counters = self.counters.iter().map(|(name, _, values)| (name.to_string(), values.to_json()));
        json!({
            "schema_version": 1,
            "device": self.device,
            "driver": self.driver,
            "kernels": shape_json(&self.shape),
            "worker_threads": self.workers.map(|workers| workers.count),
            "worker_threads_from": self.workers.map(|workers| workers.source),
            "barrier_before_each_pass": !self.overlap,
            "from_step": self.from_step,
            "warm_up": self.warm_up,
            "labels": self.timed.layers + self.timed.disagreement > 0,
            "views": self.views,
            "size": self.timed.size(),
            "sh_degree": self.timed.degrees.last(),
            "steps_with_layers": self.timed.layers,
            "steps_with_disagreement": self.timed.disagreement,
            "gaussians": self.gaussians,
            "steps_counted": self.counted(),
            "stages": self.stages.iter().map(row).collect::<Vec<_>>(),
            "passes": self.passes.iter().map(row).collect::<Vec<_>>(),
            "passes_ms": self.device_ms.to_json(),
            "host_ms": self.host_ms().to_json(),
            "processor_ms": self.cpu_ms(),
            "counters": counters.collect::<serde_json::Map<_, _>>(),
            "pairs_walked": self.pairs,
            "contributing_share": self.contributing,
            "balance_of_halves": self.balance,
            "ns_per_pair": { "blend_forward": self.ns_per_pair[0], "blend_backward": self.ns_per_pair[1] },
            "steps": self.steps,
        })
    }

    fn step_json(&self, report: &StepReport, times: Option<&StepTimes>) -> Value {
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
            "pairs_walked": walked_splats(report) * f64::from(self.shape.tile_pixels()),
            "balance_of_halves": balance(report),
            "first_run": times.map(|times| times.is_first),
            "stages_ms": stages,
        })
    }
}

impl Spread {
    fn to_json(self) -> Value {
        json!({ "median": self.median, "p90": self.p90, "mean": self.mean })
    }
}

fn instances(step: &StepReport) -> f64 {
    f64::from(step.report.counters.instance_count)
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
fn rows(times: &[StepTimes], label: impl Fn(&str) -> &str) -> Vec<(Stage, PassTime)> {
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
        let (stage, label) = named.get(&row.label)?.clone();
        Some((stage, PassTime { label, ..row }))
    });
    let mut rows: Vec<(Stage, PassTime)> = rows.collect();
    rows.sort_by_key(|(stage, _)| *stage);
    rows
}

fn spread(mut values: Vec<f64>) -> Spread {
    values.sort_by(f64::total_cmp);
    let at = |percent: usize| values.get(values.len().saturating_sub(1) * percent / 100).copied().unwrap_or(f64::NAN);
    Spread { median: at(50), p90: at(90), mean: values.iter().sum::<f64>() / values.len().max(1) as f64 }
}

fn line(name: &str, time: &PassTime) -> String {
    format!(
        "{name:<34} {:>5} {:>10.3} {:>10.3} {:>6.1}%\n",
        time.items,
        ms(time.median),
        ms(time.p90),
        time.share * 100.0
    )
}

fn spread_line(name: &str, values: Spread, digits: usize) -> String {
    format!("{name:<34} {:>16.digits$} {:>10.digits$} {:>10.digits$}\n", values.median, values.p90, values.mean)
}
