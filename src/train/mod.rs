//! Training: the loop over steps, and what happens between them.

pub mod config;
mod densify;
pub mod job;
pub mod near;
mod occlusion;
pub mod record;
mod sampler;
mod sentinel;
mod state;
mod timing;
mod views;
mod votes;

pub use config::{LabelRule, Occlusion, TrainConfig};
pub use densify::Densified;
pub use state::{RunFacts, TrainState, ViewPrint};
pub use timing::StepTimes;

use crate::engine::{Engine, LabelRoom, ListKey, Report, Room};
use crate::error::{Error, Result};
use crate::fault;
use crate::gpu::Gpu;
use crate::infer::vote::ballot::columns_for;
use crate::pass::{KernelShape, Variant};
use crate::plan::Buf;
use crate::scene::{Dataset, Gaussians};
use crate::sched::{SchedulerOptions, Ticket};
use job::{Fixed, Job, TrainView};
use sampler::ViewOrder;
use std::collections::{BTreeSet, VecDeque};
use std::sync::Arc;
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
    fixed: Fixed,
    order: ViewOrder,
    /// Steps submitted, not yet absorbed; at most one per slot.
    flying: VecDeque<(Job, Ticket)>,
    /// Steps submitted so far.
    step: u32,
    updates: u32,
    stamp: u32,
    max_gaussians: u64,
    /// Memory has bounded the number of Gaussians, which was said.
    memory_bounds: bool,
    /// Votes were counted before, so that masks can be compared with their outcome.
    labelled_once: bool,
    /// Objects have passes of their own.
    separate: bool,
    timing: Option<timing::Timing>,
    /// Blending counts the pairs that have a weight.
    counts_pairs: bool,
    seen: sentinel::Seen,
    /// What the views are told apart by; empty until somebody asks.
    prints: Vec<ViewPrint>,
}

/// Room for training on a data set.
pub fn room(dataset: &Dataset, config: &TrainConfig, gaussians: u64) -> Result<Room> {
    let sizes = dataset.train.iter().chain(&dataset.test).map(|view| (view.camera.width, view.camera.height));
    let size = sizes.reduce(|a, b| (a.0.max(b.0), a.1.max(b.1)));
    let size = size.ok_or_else(|| Error::data(&dataset.root, "", "the scene has no view to train on"))?;
    let objects: Vec<u16> =
        dataset.train.iter().filter_map(|view| view.mask.as_ref()).flat_map(|m| m.objects()).collect();
    let most = dataset.train.iter().filter_map(|view| view.mask.as_ref().map(|mask| mask.objects().len())).max();
    let labels = objects.iter().max().map(|&max_label| LabelRoom {
        max_label: u32::from(max_label),
        layers: config.label_samples.min(most.unwrap_or(0) as u32),
        vote_columns: match config.label_rule {
            LabelRule::Votes => columns_for(objects.iter().collect::<BTreeSet<_>>().len()),
            LabelRule::Main => 0,
        },
    });
    Ok(Room { gaussians, size, trained: true, labels })
}

/// Room to start with: for twice as many Gaussians as there are, or for those where memory is short.
pub fn start_room(
    gpu: &Gpu,
    dataset: &Dataset,
    config: &TrainConfig,
    gaussians: usize,
    options: SchedulerOptions,
) -> Result<Room> {
    let gaussians = gaussians as u64;
    let most = if config.max_gaussians > 0 { config.max_gaussians } else { u64::MAX };
    let roomy = room(dataset, config, (gaussians * 2).min(most).max(gaussians))?;
    match Engine::predict(gpu, &roomy, options) {
        Err(Error::OutOfMemory { .. }) => Ok(Room { gaussians, ..roomy }),
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
        room: Room,
        options: SchedulerOptions,
    ) -> Result<Self> {
        let fixed = Fixed { extent: dataset.extent() };
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
            flying: VecDeque::new(),
            step: 0,
            updates: 0,
            stamp: 0,
            max_gaussians,
            memory_bounds: false,
            labelled_once: false,
            separate: false,
            timing: None,
            counts_pairs: false,
            seen: sentinel::Seen::default(),
            prints: Vec::new(),
        })
    }

    /// The engine, for renders between steps.
    pub fn engine_mut(&mut self) -> &mut Engine {
        &mut self.engine
    }

    /// From the next step on each sampled object has passes of its own, as in the reference code: slower, and up to
    /// rounding the same. For measurements; nothing may be in flight ([`Trainer::drain`]).
    pub fn separate_objects(&mut self, separate: bool) {
        self.separate = separate;
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
            self.flying.clear();
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
        let job = self.job(step);
        if fault::at("nan").is_some() {
            self.engine.sched_mut().upload(Buf::MEANS, 0, 0, &[f32::NAN])?;
        }
        if self.flying.len() == crate::plan::SLOTS {
            done.extend(self.absorb()?);
        }
        self.submit(job.clone())?;
        self.step = step;
        let last = step >= self.config.iterations;
        let (densifies, resets) =
            (self.config.densifies_at(step) && !last, self.config.resets_opacity_at(step) && !last);
        if densifies || resets {
            done.extend(self.drain()?);
            if densifies {
                let what = self.densify(&job)?;
                tracing::debug!("step {step}: {what:?}, {} Gaussians", self.gaussian_count());
                if self.gaussian_count() == 0 {
                    return Err(Error::Pruned { step });
                }
            }
            if resets {
                self.reset_opacity(&job)?;
            }
        }
        Ok(done)
    }

    /// Waits for all steps in flight.
    pub fn drain(&mut self) -> Result<Vec<StepReport>> {
        let mut done = Vec::new();
        while !self.flying.is_empty() {
            done.extend(self.absorb()?);
        }
        Ok(done)
    }

    fn job(&mut self, step: u32) -> Job {
        let view = self.order.draw();
        let samples = if self.config.labels_at(step) { self.config.label_samples as usize } else { 0 };
        let layers = sampler::sample_objects(self.config.seed, step, &self.views[view].objects, samples);
        // A view whose mask shows nothing, or that has none, costs what a scene without masks costs.
        let labels = !layers.is_empty();
        // A densification replaces the parameters that the gradients belong to: no update then (3DGS).
        let update = !(self.config.densifies_at(step) && step < self.config.iterations);
        self.updates += u32::from(update);
        Job { step, view, layers, labels, update, updates: self.updates, stamp: 0 }
    }

    fn submit(&mut self, mut job: Job) -> Result<()> {
        self.stamp = self.stamp.wrapping_add(1).max(1);
        job.stamp = self.stamp;
        let slot = job.step as usize % crate::plan::SLOTS;
        let key = self.key(&job);
        self.engine.list(key)?;
        let view = self.views.of(&job);
        let uniforms = job::uniforms(&job, view, &self.config, self.fixed, &self.engine);
        job::upload(&mut self.engine, slot, uniforms, view, &job, &self.config)?;
        let ticket = self.engine.submit(key, slot)?;
        self.flying.push_back((job, ticket));
        Ok(())
    }

    fn key(&self, job: &Job) -> ListKey {
        let variant = Variant {
            labels: job.labels,
            lift: job.lifts(&self.config),
            sh_degree: self.config.sh_degree_at(job.step),
            size: self.engine.room().size,
            update: job.update,
            counts: self.counts_pairs,
        };
        if self.separate && job.labels {
            return ListKey::Separate(variant, job.layers.len() as u32);
        }
        ListKey::Train(variant)
    }

    /// Waits for the oldest step in flight. If a buffer was too small, the step changed nothing, nor did those after it:
    /// the buffer grows and they run again.
    fn absorb(&mut self) -> Result<Option<StepReport>> {
        let Some((job, ticket)) = self.flying.front().cloned() else { return Ok(None) };
        self.engine.sched().wait(ticket)?;
        let report = self.engine.report(job.step as usize % crate::plan::SLOTS)?;
        let recovered = self.engine.recover(&report);
        if recovered.is_err() {
            // Nothing came of these steps, nor will it.
            self.flying.clear();
            self.step = job.step - 1;
        }
        if recovered? {
            let again: Vec<Job> = self.flying.drain(..).map(|(job, _)| job).collect();
            for job in again {
                self.submit(job)?;
            }
            return self.absorb();
        }
        self.flying.pop_front();
        self.note_times(&job)?;
        let view = self.views.of(&job);
        let scale = 1.0 / (3.0 * view.valid_pixels.max(1) as f64);
        let (counters, lambda) = (&report.counters, f64::from(self.config.lambda_dssim));
        let l1 = f64::from(counters.loss_l1) * scale;
        let loss = (1.0 - lambda) * l1 + lambda * (1.0 - f64::from(counters.loss_ssim) * scale);
        let label_loss = job::label_loss(&job, view, &self.config, counters.loss_label);
        self.watch(&job, &report, [loss, label_loss])?;
        Ok(Some(StepReport { step: job.step, loss, label_loss, report }))
    }
}

fn train_view(view: &mut crate::scene::View, border: u32) -> Result<TrainView> {
    let photo = view.photo.take().ok_or_else(|| Error::Bug(format!("{} came without its photo", view.name)))?;
    let valid_pixels = job::valid_pixels(&photo);
    let mask = view.mask.take();
    let objects = mask.as_ref().map(crate::scene::LabelMap::objects).unwrap_or_default();
    let (name, camera) = (view.name.clone(), view.camera.clone());
    let view_labels = mask.as_ref().map(|mask| job::view_labels(mask, border)).unwrap_or_default();
    let shown = job::shown_objects(&photo, &view_labels);
    let occluders = Default::default();
    Ok(TrainView { name, camera, photo, valid_pixels, mask, objects, view_labels, shown, occluders })
}
