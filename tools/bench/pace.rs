//! Steps of several trainings, timed in turn, so that the load of the machine affects all of them alike.

use super::measure::{median, timed};
use super::trained::timing_config;
use labelgs::cli::commands::profile::timed::TimedWork;
use labelgs::gpu::Gpu;
use labelgs::pass::Stage;
use labelgs::scene::{Dataset, Gaussians};
use labelgs::scheduler::SchedulerOptions;
use labelgs::train::{StepReport, Trainer};
use labelgs::{Error, Result};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Steps in a row without a wait in between, because a GPU that waits for the host lowers its clock. One of them has
/// object layers.
const STEPS_PER_TURN: u32 = 8;

/// A training whose steps are timed, on full-size photos with all colour bands and, with masks, labels.
pub struct Pace {
    /// Name in tables.
    pub name: String,
    trainer: Trainer,
    tile_pixels: f64,
    /// Total pass time per step, ms.
    pub passes: Vec<f64>,
    /// The same by stage.
    pub stages: BTreeMap<Stage, Vec<f64>>,
    /// Host time per step, ms, by turn.
    pub wall: Vec<f64>,
    /// CPU time of all threads per step, ms, by turn.
    pub processor: Vec<f64>,
    /// Reports per step.
    pub reports: Vec<StepReport>,
    /// Items in the step's list.
    pub items: usize,
}

impl Pace {
    /// Starts a training from `model`, without densification, and with labels from the first step if there are masks.
    pub fn new(name: &str, gpu: &Arc<Gpu>, dataset: Dataset, model: &Gaussians) -> Result<Self> {
        let options = SchedulerOptions { timestamps: true, ..SchedulerOptions::default() };
        let mut trainer = Trainer::new(Arc::clone(gpu), timing_config(), &dataset, model, options)?;
        trainer.keep_times();
        let tile_pixels = f64::from(trainer.engine_mut().shape().tile_pixels());
        Ok(Self {
            tile_pixels,
            name: name.to_owned(),
            trainer,
            passes: Vec::new(),
            stages: BTreeMap::new(),
            wall: Vec::new(),
            processor: Vec::new(),
            reports: Vec::new(),
            items: 0,
        })
    }

    /// Does the label work of a default run besides its steps, and returns the CPU time, ms: votes and occluders when
    /// labels start, and votes at the end.
    pub fn sweeps(&mut self) -> Result<f64> {
        if !self.trainer.has_labels() {
            return Ok(0.0);
        }
        // The driver compiles when a list first runs, so run each once before. As in a run, masks are not judged yet
        // when labels start.
        self.trainer.labelled_model()?;
        self.trainer.refresh_occluders()?;
        let (_, start) = timed(|| {
            self.trainer.refresh_labels()?;
            self.trainer.refresh_occluders()
        })?;
        self.trainer.labelled_model()?;
        let (_, end) = timed(|| self.trainer.labelled_model())?;
        Ok(start.cpu + end.cpu)
    }

    /// Runs steps and waits for the last one. Steps in which the driver compiles are not counted.
    fn turn(&mut self) -> Result<()> {
        let (reports, cost) = timed(|| {
            let mut reports = Vec::new();
            for _ in 0..STEPS_PER_TURN {
                reports.extend(self.trainer.step()?);
            }
            reports.extend(self.trainer.drain()?);
            Ok(reports)
        })?;
        let times = self.trainer.take_times();
        if times.iter().all(|times| !times.is_first) {
            self.wall.push(cost.wall / f64::from(STEPS_PER_TURN));
            self.processor.push(cost.cpu / f64::from(STEPS_PER_TURN));
        }
        for times in times.iter().filter(|times| !times.is_first) {
            let report = reports.iter().find(|report| report.step == times.step);
            let report = report.ok_or_else(|| Error::Bug("a step that was waited for has no report".to_owned()))?;
            self.reports.push(*report);
            self.items = times.items.len();
            let mut stages: BTreeMap<Stage, f64> = BTreeMap::new();
            for (stage, _, ns) in &times.items {
                *stages.entry(*stage).or_default() += *ns as f64 / 1e6;
            }
            self.passes.push(stages.values().sum());
            stages.into_iter().for_each(|(stage, ms)| self.stages.entry(stage).or_default().push(ms));
        }
        Ok(())
    }

    /// Returns the median over the steps of a number in their reports.
    pub fn median(&self, value: impl Fn(&StepReport) -> f64) -> f64 {
        median(self.reports.iter().map(value))
    }

    /// Returns the (pixel, splat) pairs that each step walked.
    pub fn pairs(&self) -> Vec<f64> {
        self.reports.iter().map(|report| report.report.counters.walked_splats() as f64 * self.tile_pixels).collect()
    }

    /// Describes the workload of the steps, for tables and JSON.
    pub fn about(&self) -> (String, Value) {
        let (gaussians, pairs) = (self.trainer.gaussian_count(), median(self.pairs()));
        let timed = TimedWork::new(&self.reports);
        let (width, height) = timed.size();
        let counted = |value: fn(&StepReport) -> u32| self.median(|report| f64::from(value(report)));
        let visible = counted(|report| report.report.counters.visible_count);
        let instances = counted(|report| report.report.counters.instance_count);
        let longest = counted(|report| report.report.counters.longest_list);
        let text = format!(
            "{}; {gaussians} Gaussians, {visible} visible, {instances} (splat, tile) pairs, {:.1} M (pixel, splat) pairs, \
             {:.0} a pixel, {longest} splats in the fullest tile",
            timed.to_text(),
            pairs / 1e6,
            pairs / timed.pixels
        );
        let found = json!({
            "size": [width, height], "sh_degree": timed.degrees.last(), "labels": timed.layers + timed.disagreement > 0,
            "steps": self.reports.len(), "gaussians": gaussians, "visible": visible, "instances": instances,
            "pairs": pairs, "longest_list": longest,
        });
        (text, found)
    }
}

/// Runs the trainings in turn until each has enough timed steps.
pub fn race(paces: &mut [Pace], steps: usize) -> Result<()> {
    while paces.iter().any(|pace| pace.passes.len() < steps || pace.wall.is_empty()) {
        for pace in paces.iter_mut() {
            pace.turn()?;
        }
    }
    Ok(())
}
