//! The loop over steps.

mod checkpoint;
mod results;
mod sentinel;
mod timing;

pub use checkpoint::PendingState;
pub(crate) use timing::StepTimes;

use crate::engine::{Engine, EngineSize, InFlight};
use crate::error::Result;
use crate::gpu::Gpu;
use crate::lab::fault;
use crate::render::RenderOptions;
use crate::scene::{Dataset, Gaussians};
use crate::train::TrainConfig;
use crate::train::between::{JobTime, TrainingJobs};
use crate::train::context::Context;
use crate::train::input::free_space;
use crate::train::input::sampler::{self, ViewOrder};
use crate::train::input::step_input::{StepInput, TrainView};
use crate::train::objective::Loss;
use crate::train::report::StepReport;
use crate::train::setup::near_plane;
use crate::train::setup::{self, TrainerOptions, start_size};
use crate::train::state::ViewFingerprint;
use crate::train::strategy::DensifyCounts;
use sentinel::Sentinel;
use std::collections::VecDeque;
use std::sync::Arc;
use timing::Timing;

/// A model in training.
pub struct Trainer {
    context: Context,
    jobs: TrainingJobs,
    order: ViewOrder,
    /// Submitted steps that are not yet retired, at most one per frame.
    in_flight: VecDeque<(StepInput, InFlight)>,
    step: u32,
    updates: u32,
    sentinel: Sentinel,
    timing: Option<Timing>,
    /// Fingerprints of the views; empty until first used.
    fingerprints: Vec<ViewFingerprint>,
    newest: Option<StepReport>,
}

impl Trainer {
    /// Uploads the initial model.
    pub fn new(
        gpu: Arc<Gpu>,
        config: TrainConfig,
        dataset: &Dataset,
        model: &Gaussians,
        options: impl Into<TrainerOptions>,
    ) -> Result<Self> {
        config.check()?;
        let options = options.into();
        let config = options.objective.limit_config(config);
        let size = start_size(&gpu, dataset, &config, (model, options.region.as_ref()), options.scheduler)?;
        let near = match config.near {
            0.0 => near_plane::near_plane(dataset.train.iter().map(|view| &view.camera), model),
            near => near,
        };
        let config = TrainConfig { near, ..setup::for_photos(&config, dataset)? };
        let mut trainer = Self::without_model(gpu, config, dataset, size, options)?;
        let Context { engine, config, views, shared, .. } = &mut trainer.context;
        engine.upload_model(model)?;
        let planes =
            if config.free_space { free_space::view_planes(dataset, model, near) } else { vec![near; views.len()] };
        views.set_near_planes(&planes);
        engine.set_shared(&shared.start(views.len())?)?;
        // Colour bands that the model lacks start at 0.
        engine.set_sh_degree(config.sh_degree);
        engine.set_antialiased(config.antialias);
        Ok(trainer)
    }

    fn without_model(
        gpu: Arc<Gpu>,
        config: TrainConfig,
        dataset: &Dataset,
        size: EngineSize,
        options: TrainerOptions,
    ) -> Result<Self> {
        let mut context = Context::new(gpu, config, dataset, size, options)?;
        // On a CPU device, compiling would slow down the steps.
        if context.engine.runs_ahead() {
            let lists = context.lists_ahead();
            context.engine.compile_ahead(lists);
        }
        let jobs = TrainingJobs::new(&context.config);
        Ok(Self {
            order: ViewOrder::new(context.config.seed, context.views.parts().len()),
            context,
            jobs,
            in_flight: VecDeque::new(),
            step: 0,
            updates: 0,
            sentinel: Sentinel::default(),
            timing: None,
            fingerprints: Vec::new(),
            newest: None,
        })
    }

    /// Returns the engine, for renders between steps. Nothing may be in flight ([`Trainer::drain`]).
    pub fn engine_mut(&mut self) -> &mut Engine {
        &mut self.context.engine
    }

    /// Returns the configuration.
    pub fn config(&self) -> &TrainConfig {
        &self.context.config
    }

    /// Returns the training views.
    pub fn views(&self) -> &[TrainView] {
        &self.context.views
    }

    /// Returns the number of submitted steps.
    pub fn steps_done(&self) -> u32 {
        self.step
    }

    /// Returns the report of the newest finished step.
    pub fn newest_report(&self) -> Option<StepReport> {
        self.newest
    }

    /// Takes the counts of the last densification; `None` if they were already taken.
    pub fn take_densified(&mut self) -> Option<DensifyCounts> {
        self.jobs.growth.densified.take()
    }

    /// Returns the number of Gaussians in the model.
    pub fn gaussian_count(&self) -> u32 {
        self.context.engine.gaussian_count()
    }

    /// Returns the render options of the steps, for previews.
    pub fn render_options(&self) -> RenderOptions {
        let config @ &TrainConfig { near, background, .. } = self.config();
        let (sh_degree, clear_labels) = (Some(config.sh_degree_at(self.step)), self.context.objects_only);
        RenderOptions { near, background, sh_degree, clear_labels, ..RenderOptions::default() }
    }

    /// Halves all learning rates for the rest of the run.
    pub fn halve_rates(&mut self) {
        self.context.config.halve_rates();
    }

    /// Leaves only these objects to the object layers of the steps.
    pub(super) fn show_only(&mut self, is_meant: impl Fn(&u16) -> bool) {
        self.context.views.show_only(is_meant);
    }

    /// Submits a step, and runs the jobs that are due before and after it. Returns the reports of finished steps, which
    /// lag behind because some steps are in flight.
    pub fn step(&mut self) -> Result<Vec<StepReport>> {
        let step = self.step + 1;
        let mut done = self.work(JobTime::Before, step)?;
        let input = self.input(step)?;
        if fault::injected("nan").is_some() {
            self.context.engine.spoil()?;
        }
        done.extend(self.submit_next(input)?);
        self.step = step;
        done.extend(self.work(JobTime::After, step)?);
        Ok(done)
    }

    /// Runs the jobs that are due before or after a step, after waiting for the steps in flight. Returns their reports.
    fn work(&mut self, when: JobTime, step: u32) -> Result<Vec<StepReport>> {
        let due: Vec<bool> = self.jobs.list(when).iter().map(|job| job.is_due(step, &self.context)).collect();
        let done = if due.contains(&true) { self.drain()? } else { Vec::new() };
        for (job, _) in self.jobs.list(when).into_iter().zip(due).filter(|(_, is_due)| *is_due) {
            job.run(step, &mut self.context)?;
        }
        Ok(done)
    }

    /// Waits for all steps in flight.
    pub fn drain(&mut self) -> Result<Vec<StepReport>> {
        let mut done = Vec::new();
        while !self.in_flight.is_empty() {
            done.extend(self.retire()?);
        }
        Ok(done)
    }

    /// Draws the view of a step, and the objects of its layers.
    fn input(&mut self, step: u32) -> Result<StepInput> {
        let Context { config, objective, views, .. } = &mut self.context;
        let part = self.order.draw();
        let next = self.order.upcoming(views.steps_ahead());
        views.prepare(step, part, &next)?;
        let objects = &views.parts()[part].objects;
        // A view without a mask, or with an empty mask, costs no more than in a scene without masks.
        let labels = config.labels_at(step) && !objects.is_empty();
        let layers = if labels && objective.has(Loss::Layers) && config.has_layers_at(step) {
            sampler::sample_objects(config.seed, step, objects, config.label_samples as usize)
        } else {
            Vec::new()
        };
        let disagrees = objective.has(Loss::Disagreement) && config.has_disagreement_at(step);
        let labels = labels && (!layers.is_empty() || disagrees);
        let update = self.context.strategy.updates(self.context.step_context(step));
        self.updates += u32::from(update);
        Ok(StepInput { step, part, layers, labels, update, updates: self.updates })
    }

    /// Submits a step, and first waits for the oldest one if its frame is still in use.
    fn submit_next(&mut self, input: StepInput) -> Result<Option<StepReport>> {
        let done = if self.in_flight.len() == self.context.engine.frames() { self.retire()? } else { None };
        self.submit(input)?;
        Ok(done)
    }

    fn submit(&mut self, input: StepInput) -> Result<()> {
        let flight = self.context.submit(&input)?;
        self.in_flight.push_back((input, flight));
        Ok(())
    }

    /// Waits for the oldest step in flight. If a buffer was too small, this step and all later ones had no effect: the
    /// buffer grows and they run again.
    fn retire(&mut self) -> Result<Option<StepReport>> {
        let Some((input, flight)) = self.in_flight.front().cloned() else { return Ok(None) };
        let engine = &mut self.context.engine;
        let report = engine.retire(&flight)?;
        let recovered = engine.recover(&report);
        if recovered.is_err() {
            // These steps have no result and never will.
            self.in_flight.clear();
            self.step = input.step - 1;
        }
        if recovered? {
            let again: Vec<StepInput> = self.in_flight.drain(..).map(|(input, _)| input).collect();
            for input in again {
                self.submit(input)?;
            }
            return self.retire();
        }
        self.in_flight.pop_front();
        if let Some(timing) = &mut self.timing {
            timing.note(&mut self.context.engine, input.step, flight.recording)?;
        }
        let Context { config, views, .. } = &self.context;
        let report = StepReport::new(&input, views.step_view(&input)?, config, report);
        self.sentinel.check(&report, &views[views.index(&input)].name)?;
        self.newest = Some(report);
        Ok(self.newest)
    }

    /// Starts collecting step times. The scheduler must have timestamps.
    pub fn keep_times(&mut self) {
        self.timing.get_or_insert_default();
    }

    /// Stops collecting step times: the next steps run without timestamps. Nothing may be in flight.
    #[cfg(feature = "cli")]
    pub(crate) fn stop_times(&mut self) -> Result<()> {
        self.timing = None;
        self.context.engine.time_items(false, false)
    }

    /// Sets whether the next steps count contributing (pixel, splat) pairs, which slows them down.
    pub fn count_pairs(&mut self, on: bool) {
        self.context.counts_pairs = on;
    }

    /// Takes the times of the steps that finished since the last call.
    pub fn take_times(&mut self) -> Vec<StepTimes> {
        self.timing.as_mut().map(Timing::take).unwrap_or_default()
    }

    /// Repeats the last `count` steps on `model` with a barrier before every pass, and returns their times. Call this
    /// only after all steps: the trainer and its model are unusable afterwards.
    pub(crate) fn times_of_last(&mut self, count: u32, model: &Gaussians) -> Result<Vec<StepTimes>> {
        self.drain()?;
        self.context.engine.upload_model(model)?;
        self.context.engine.time_items(true, true)?;
        self.keep_times();
        for step in self.step - count.min(self.step)..self.step {
            let input = self.input(step + 1)?;
            self.submit_next(input)?;
        }
        self.drain()?;
        Ok(self.take_times())
    }
}
