//! Steps of several trainings, timed in turn, so that a busy machine is equally busy for all of them.

use super::measure::timed;
use super::trained::{timed_step, timing_config};
use labelgs::gpu::Gpu;
use labelgs::pass::Stage;
use labelgs::run::TrainConfig;
use labelgs::scene::{Dataset, Gaussians};
use labelgs::scheduler::SchedulerOptions;
use labelgs::train::Trainer;
use labelgs::{Error, Result};
use std::collections::BTreeMap;
use std::sync::Arc;

/// A training whose steps are timed one by one.
pub struct Pace {
    /// Name in tables.
    pub name: String,
    trainer: Trainer,
    /// Sum of the passes, ms, by step.
    pub passes: Vec<f64>,
    /// The same by stage.
    pub stages: BTreeMap<Stage, Vec<f64>>,
    /// Host's clock from submit to end, ms, by step.
    pub wall: Vec<f64>,
    /// Processor time of all threads, ms, by step.
    pub processor: Vec<f64>,
    /// (pixel, splat) pairs walked, by step.
    pub pairs: Vec<f64>,
    /// Visible splats, by step.
    pub splats: Vec<f64>,
    /// (splat, tile) pairs, by step.
    pub instances: Vec<f64>,
    /// Items of the step's list.
    pub items: usize,
}

impl Pace {
    /// Starts a training from `model`, without densification, and with labels from the first step if there are masks.
    pub fn new(name: &str, gpu: &Arc<Gpu>, dataset: Dataset, model: &Gaussians) -> Result<Self> {
        // Bands of colour come in as in any training.
        let config = TrainConfig { sh_degree_interval: Some(1000), ..timing_config() };
        let options = SchedulerOptions { timestamps: true, ..SchedulerOptions::default() };
        let mut trainer = Trainer::new(Arc::clone(gpu), config, &dataset, model, options)?;
        trainer.keep_times();
        Ok(Self {
            name: name.to_owned(),
            trainer,
            passes: Vec::new(),
            stages: BTreeMap::new(),
            wall: Vec::new(),
            processor: Vec::new(),
            pairs: Vec::new(),
            splats: Vec::new(),
            instances: Vec::new(),
            items: 0,
        })
    }

    /// Does what a run of default settings does for labels besides its steps, and returns the processor time, ms: votes
    /// and occluders when labels start, and votes at the end.
    pub fn sweeps(&mut self) -> Result<f64> {
        if !self.trainer.has_labels() {
            return Ok(0.0);
        }
        // The driver compiles when a list first runs, so each runs once before. As in a run, masks are not yet judged
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

    /// Runs one step and waits for it. Steps in which the driver compiles are not counted.
    pub fn step(&mut self) -> Result<()> {
        let (reports, cost) = timed_step(&mut self.trainer)?;
        let (times, last) = (self.trainer.take_times(), reports.last());
        let (Some(times), Some(last)) = (times.last(), last) else {
            return Err(Error::Bug("a step that was waited for has no report".to_owned()));
        };
        if times.is_first {
            return Ok(());
        }
        self.items = times.items.len();
        self.passes.push(times.items.iter().map(|(_, _, ns)| *ns as f64 / 1e6).sum());
        let mut stages: BTreeMap<Stage, f64> = BTreeMap::new();
        for (stage, _, ns) in &times.items {
            *stages.entry(*stage).or_default() += *ns as f64 / 1e6;
        }
        stages.into_iter().for_each(|(stage, ms)| self.stages.entry(stage).or_default().push(ms));
        self.wall.push(cost.wall);
        self.processor.push(cost.cpu);
        let pixels = f64::from(self.trainer.engine_mut().shape().tile_pixels());
        self.splats.push(f64::from(last.report.counters.visible_count));
        self.instances.push(f64::from(last.report.counters.instance_count));
        self.pairs.push(last.report.counters.walked_splats() as f64 * pixels);
        Ok(())
    }
}

/// Runs the trainings in turn until each has the wanted number of timed steps.
pub fn race(paces: &mut [Pace], steps: usize) -> Result<()> {
    while paces.iter().any(|pace| pace.wall.len() < steps) {
        for pace in paces.iter_mut() {
            pace.step()?;
        }
    }
    Ok(())
}
