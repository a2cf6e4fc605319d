//! Training: the loop over steps, and what happens between them.

pub mod config;
mod densify;
pub mod near;
mod occlusion;
pub mod record;
mod sampler;
mod sentinel;
mod separate;
mod state;
pub mod step_input;
mod timing;
mod views;
mod votes;

pub use config::{LabelRule, Occlusion, TrainConfig};
pub use densify::Densified;
pub use state::{RunFacts, TrainState, ViewFingerprint};
pub use timing::StepTimes;

use crate::engine::{Engine, EngineSize, LabelSize, ListKey, Report};
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::lab::fault;
use crate::label::vote::ballot::columns_for;
use crate::pass::{KernelShape, Variant};
use crate::scene::{Dataset, Gaussians};
use crate::scheduler::plan::Buf;
use crate::scheduler::{SchedulerOptions, Ticket};
use sampler::ViewOrder;
use std::collections::{BTreeSet, VecDeque};
use std::sync::Arc;
use step_input::{SceneScale, StepInput, TrainView};
use views::Views;

/// What is known about a finished step.
#[derive(Clone, Copy, Debug)]
pub struct StepReport {
    /// Step, from 1.
    pub step: u32,
    /// Photo loss: (1 - lambda) L1 + lambda (1 - SSIM).
    pub loss: f64,
    /// Label loss, weighted.
    pub label_loss: f64,
    /// What the device counted.
    pub report: Report,
}

/// A model in training.
pub struct Trainer {
    engine: Engine,
    config: TrainConfig,
    views: Views,
    fixed: SceneScale,
    order: ViewOrder,
    /// Steps submitted, not yet absorbed; at most one per frame.
    in_flight: VecDeque<(StepInput, Ticket)>,
    /// Steps submitted so far.
    step: u32,
    updates: u32,
    stamp: u32,
    max_gaussians: u64,
    /// Memory has bounded the number of Gaussians, which was said.
    memory_bounds: bool,
    /// Votes were counted before, so that masks can be compared with their outcome.
    labelled_once: bool,
    separate: separate::Separate,
    timing: Option<timing::Timing>,
    /// Blending counts the pairs that have a weight.
    counts_pairs: bool,
    seen: sentinel::Seen,
    /// What the views are told apart by; empty until somebody asks.
    fingerprints: Vec<ViewFingerprint>,
}

/// Room for training on a data set.
pub fn room(dataset: &Dataset, config: &TrainConfig, gaussians: u64) -> Result<EngineSize> {
    let sizes = dataset.train.iter().chain(&dataset.test).map(|view| (view.camera.width, view.camera.height));
    let size = sizes.reduce(|a, b| (a.0.max(b.0), a.1.max(b.1)));
    let size = size.ok_or_else(|| Error::data(&dataset.root, "", "the scene has no view to train on"))?;
    let objects: Vec<u16> =
        dataset.train.iter().filter_map(|view| view.mask.as_ref()).flat_map(|m| m.objects()).collect();
    let most = dataset.train.iter().filter_map(|view| view.mask.as_ref().map(|mask| mask.objects().len())).max();
    let labels = objects.iter().max().map(|&max_label| LabelSize {
        max_label: u32::from(max_label),
        layers: config.label_samples.min(most.unwrap_or(0) as u32),
        vote_columns: match config.label_rule {
            LabelRule::Votes => columns_for(objects.iter().collect::<BTreeSet<_>>().len()),
            LabelRule::Main => 0,
        },
    });
    Ok(EngineSize { gaussians, size, trained: true, labels })
}

/// Room to start with: for twice as many Gaussians as there are, or for those where memory is short.
pub fn start_room(
    gpu: &Gpu,
    dataset: &Dataset,
    config: &TrainConfig,
    gaussians: usize,
    options: SchedulerOptions,
) -> Result<EngineSize> {
    let gaussians = gaussians as u64;
    let most = if config.max_gaussians > 0 { config.max_gaussians } else { u64::MAX };
    let roomy = room(dataset, config, (gaussians * 2).min(most).max(gaussians))?;
    match Engine::predict(gpu, &roomy, options) {
        Err(Error::OutOfMemory { .. }) => Ok(EngineSize { gaussians, ..roomy }),
        other => other.map(|_| roomy),
    }
}

impl Trainer {
    /// Puts the initial model on the device. `dataset.train` gives its photos and masks away.
    pub fn new(
        gpu: Arc<Gpu>,
        config: TrainConfig,
        dataset: &mut Dataset,
        model: &Gaussians,
        options: SchedulerOptions,
    ) -> Result<Self> {
        let shape = KernelShape::of(gpu.capabilities());
        Self::with_shape(gpu, shape, config, dataset, model, options)
    }

    /// As [`Trainer::new`], with kernels of a given shape.
    pub fn with_shape(
        gpu: Arc<Gpu>,
        shape: KernelShape,
        config: TrainConfig,
        dataset: &mut Dataset,
        model: &Gaussians,
        options: SchedulerOptions,
    ) -> Result<Self> {
        config.check()?;
        let room = start_room(&gpu, dataset, &config, model.len(), options)?;
        let near = match config.near {
            0.0 => near::near_plane(dataset.train.iter().map(|view| &view.camera), model),
            near => near,
        };
        let config = TrainConfig { near, ..config };
        let mut trainer = Self::without_model(gpu, shape, config, dataset, room, options)?;
        trainer.engine.upload_model(model)?;
        Ok(trainer)
    }

    fn without_model(
        gpu: Arc<Gpu>,
        shape: KernelShape,
        config: TrainConfig,
        dataset: &mut Dataset,
        room: EngineSize,
        options: SchedulerOptions,
    ) -> Result<Self> {
        let fixed = SceneScale { extent: dataset.extent() };
        let max_gaussians = if config.max_gaussians > 0 { config.max_gaussians } else { u64::from(u32::MAX) };
        let views =
            dataset.train.iter_mut().map(|view| train_view(view, config.mask_border)).collect::<Result<Vec<_>>>()?;
        let views = Views::new(views, config.coarse_until);
        let engine = Engine::with_shape(gpu, shape, room, options)?;
        let order = ViewOrder::new(config.seed, views.len());
        Ok(Self {
            engine,
            config,
            views,
            fixed,
            order,
            in_flight: VecDeque::new(),
            step: 0,
            updates: 0,
            stamp: 0,
            max_gaussians,
            memory_bounds: false,
            labelled_once: false,
            separate: separate::Separate::default(),
            timing: None,
            counts_pairs: false,
            seen: sentinel::Seen::default(),
            fingerprints: Vec::new(),
        })
    }

    /// The engine, for renders between steps.
    pub fn engine_mut(&mut self) -> &mut Engine {
        &mut self.engine
    }

    /// The configuration.
    pub fn config(&self) -> &TrainConfig {
        &self.config
    }

    /// Makes all learning rates half of what they are, for the rest of the run.
    pub fn halve_rates(&mut self) {
        self.config.halve_rates();
    }

    /// The training views.
    pub fn views(&self) -> &[TrainView] {
        &self.views
    }

    /// Steps submitted so far.
    pub fn steps_done(&self) -> u32 {
        self.step
    }

    /// Gaussians of the model.
    pub fn gaussian_count(&self) -> u32 {
        self.engine.gaussian_count()
    }

    /// Degree of the spherical harmonics in use.
    pub fn sh_degree(&self) -> u32 {
        self.config.sh_degree_at(self.step)
    }

    /// Reads the model back. Steps that failed for want of memory changed nothing in it.
    pub fn model(&mut self) -> Result<Gaussians> {
        if let Err(error) = self.drain() {
            if !error.is_out_of_memory() {
                return Err(error);
            }
            self.in_flight.clear();
        }
        self.engine.download_model(self.config.sh_degree)
    }

    /// One step: submits it and, where the schedule says so, densifies. Returns the reports of steps that are done;
    /// they lag behind, because two steps are in flight.
    pub fn step(&mut self) -> Result<Vec<StepReport>> {
        let step = self.step + 1;
        let mut done = Vec::new();
        if self.counts_votes(step) {
            done.extend(self.drain()?);
            self.refresh_labels()?;
        }
        if self.refreshes_occluders(step) {
            done.extend(self.drain()?);
            self.refresh_occluders()?;
        }
        let input = self.input(step);
        if fault::at("nan").is_some() {
            self.engine.sched_mut().upload(Buf::MEANS, 0, 0, &[f32::NAN])?;
        }
        if self.in_flight.len() == crate::scheduler::plan::FRAMES_IN_FLIGHT {
            done.extend(self.retire()?);
        }
        self.submit(input.clone())?;
        self.step = step;
        let last = step >= self.config.iterations;
        let (densifies, resets) =
            (self.config.densifies_at(step) && !last, self.config.resets_opacity_at(step) && !last);
        if densifies || resets {
            done.extend(self.drain()?);
            if densifies {
                let what = self.densify(&input)?;
                tracing::debug!("step {step}: {what:?}, {} Gaussians", self.gaussian_count());
                if self.gaussian_count() == 0 {
                    return Err(Error::Pruned { step });
                }
            }
            if resets {
                self.reset_opacity(&input)?;
            }
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

    fn input(&mut self, step: u32) -> StepInput {
        let view = self.order.draw();
        let samples = if self.config.labels_at(step) { self.config.label_samples as usize } else { 0 };
        let layers = sampler::sample_objects(self.config.seed, step, &self.views[view].objects, samples);
        // A view whose mask shows nothing, or that has none, costs what a scene without masks costs.
        let labels = !layers.is_empty();
        // A densification replaces the parameters that the gradients belong to: no update then (3DGS).
        let update = !(self.config.densifies_at(step) && step < self.config.iterations);
        self.updates += u32::from(update);
        StepInput { step, view, layers, labels, update, updates: self.updates, stamp: 0 }
    }

    fn submit(&mut self, mut input: StepInput) -> Result<()> {
        self.stamp = self.stamp.wrapping_add(1).max(1);
        input.stamp = self.stamp;
        let frame = input.step as usize % crate::scheduler::plan::FRAMES_IN_FLIGHT;
        let key = self.key(&input);
        self.engine.list(key)?;
        let view = self.views.of(&input);
        let uniforms = step_input::uniforms(&input, view, &self.config, self.fixed, &self.engine);
        step_input::upload(&mut self.engine, frame, uniforms, view, &input, &self.config)?;
        let ticket = self.engine.submit(key, frame)?;
        self.in_flight.push_back((input, ticket));
        Ok(())
    }

    fn key(&self, input: &StepInput) -> ListKey {
        let variant = Variant {
            labels: input.labels,
            lift: input.lifts(&self.config),
            sh_degree: self.config.sh_degree_at(input.step),
            size: self.engine.room().size,
            update: input.update,
            counts: self.counts_pairs,
        };
        self.separate.key(variant, input)
    }

    /// Waits for the oldest step in flight. If a buffer was too small, the step changed nothing, nor did those after it:
    /// the buffer grows and they run again.
    fn retire(&mut self) -> Result<Option<StepReport>> {
        let Some((input, ticket)) = self.in_flight.front().cloned() else { return Ok(None) };
        self.engine.sched().wait(ticket)?;
        let report = self.engine.report(input.step as usize % crate::scheduler::plan::FRAMES_IN_FLIGHT)?;
        let recovered = self.engine.recover(&report);
        if recovered.is_err() {
            // Nothing came of these steps, nor will it.
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
        self.note_times(&input)?;
        let view = self.views.of(&input);
        let scale = 1.0 / (3.0 * view.valid_pixels.max(1) as f64);
        let (counters, lambda) = (&report.counters, f64::from(self.config.lambda_dssim));
        let l1 = f64::from(counters.loss_l1) * scale;
        let loss = (1.0 - lambda) * l1 + lambda * (1.0 - f64::from(counters.loss_ssim) * scale);
        let label_loss = step_input::label_loss(&input, view, &self.config, counters.loss_label);
        self.watch(&input, &report, [loss, label_loss])?;
        Ok(Some(StepReport { step: input.step, loss, label_loss, report }))
    }
}

fn train_view(view: &mut crate::scene::View, border: u32) -> Result<TrainView> {
    let photo = view.photo.take().ok_or_else(|| Error::Bug(format!("{} came without its photo", view.name)))?;
    let valid_pixels = step_input::valid_pixels(&photo);
    let mask = view.mask.take();
    let objects = mask.as_ref().map(crate::scene::LabelMap::objects).unwrap_or_default();
    let (name, camera) = (view.name.clone(), view.camera.clone());
    let view_labels = mask.as_ref().map(|mask| step_input::view_labels(mask, border)).unwrap_or_default();
    let shown = step_input::shown_objects(&photo, &view_labels);
    let occluders = Default::default();
    Ok(TrainView { name, camera, photo, valid_pixels, mask, objects, view_labels, shown, occluders })
}
