//! Training: the loop over steps, and the work between steps.
//!
//! [`Trainer`] owns the model on the device. [`TrainConfig`] has every hyper-parameter; a [`Strategy`] changes the
//! number of Gaussians, [`Shared`] parameters belong to the scene or to a photo. [`crate::run`] adds files and scores.

mod adjust;
mod ahead;
pub(crate) mod align;
mod alone;
mod backdrop;
mod between;
pub(crate) mod config;
pub(crate) mod depths;
pub(crate) mod exposure;
mod first;
pub(crate) mod free_space;
pub(crate) mod kinds;
pub(crate) mod near;
mod occlusion;
mod parts;
mod photo_rows;
pub(crate) mod poses;
mod precondition;
mod presets;
pub(crate) mod region;
mod sampler;
mod schedule;
mod sentinel;
mod separate;
pub(crate) mod setup;
pub(crate) mod shared;
pub(crate) mod state;
pub(crate) mod step_input;
mod step_kind;
pub(crate) mod strategy;
mod timing;
mod views;
mod votes;

pub use align::aligned;
pub use alone::{REFIT_STEPS, refitted};
pub use config::TrainConfig;
pub use first::first_model;
pub(crate) use first::go_on_from;
pub use kinds::{ExposureMode, LabelRule, Occlusion, StrategyKind};
pub use presets::Preset;
pub(crate) use setup::{TrainerOptions, engine_size, start_size};
pub(crate) use state::{TrainState, ViewFingerprint};
pub use step_kind::{LabelWork, StepKind};
pub use strategy::Densified;
pub(crate) use timing::StepTimes;

use crate::engine::{Engine, EngineSize, InFlight, ListKey, Report, TrainInput};
use crate::error::Result;
use crate::gpu::Gpu;
use crate::lab::fault;
use crate::pass::{KernelShape, Variant};
use crate::render::RenderOptions;
use crate::scene::{Dataset, Gaussians};
use crate::scheduler::plan::FRAMES_IN_FLIGHT;
use crate::shaders::structs::StepUniforms;
use region::Region;
use sampler::ViewOrder;
use shared::Shared;
use std::collections::VecDeque;
use std::sync::Arc;
use step_input::{SceneScale, StepInput, TrainView};
use strategy::{At, Bound, Population, Strategy};
use views::Views;

/// The numbers of a finished step.
#[derive(Clone, Copy, Debug)]
pub struct StepReport {
    /// Step, from 1.
    pub step: u32,
    /// Photo loss: (1 - lambda) L1 + lambda (1 - SSIM).
    pub loss: f64,
    /// Mean absolute difference of colours.
    pub l1: f64,
    /// Structural similarity.
    pub ssim: f64,
    /// Weighted label loss.
    pub label_loss: f64,
    /// What it worked on.
    pub kind: StepKind,
    /// Counters of the device.
    pub report: Report,
}

/// A model in training.
pub struct Trainer {
    engine: Engine,
    config: TrainConfig,
    views: Views,
    fixed: SceneScale,
    region: Option<Region>,
    order: ViewOrder,
    /// Size of the largest part of a photo, px. The image of the engine may be larger, because it grows.
    image: (u32, u32),
    /// Submitted steps that are not retired yet, at most one per frame.
    in_flight: VecDeque<(StepInput, InFlight)>,
    step: u32,
    updates: u32,
    bound: Bound,
    strategy: Box<dyn Strategy>,
    shared: Shared,
    /// Votes were counted before, so that masks can be compared with the labels.
    labelled_once: bool,
    separate: separate::Separate,
    timing: Option<timing::Timing>,
    /// The blend passes count the pairs with a weight.
    counts_pairs: bool,
    seen: sentinel::Seen,
    /// Fingerprints of the views; empty until first used.
    fingerprints: Vec<ViewFingerprint>,
    newest: Option<StepReport>,
    /// The last densification, until it is taken.
    densified: Option<Densified>,
}

impl Trainer {
    /// Puts the initial model on the device.
    pub fn new(
        gpu: Arc<Gpu>,
        config: TrainConfig,
        dataset: &Dataset,
        model: &Gaussians,
        options: impl Into<TrainerOptions>,
    ) -> Result<Self> {
        config.check()?;
        let options = options.into();
        let size = start_size(&gpu, dataset, &config, (model, options.region.as_ref()), options.scheduler)?;
        let near = match config.near {
            0.0 => near::near_plane(dataset.train.iter().map(|view| &view.camera), model),
            near => near,
        };
        let config = TrainConfig { near, ..setup::for_photos(&config, dataset)? };
        let mut trainer = Self::without_model(gpu, config, dataset, size, options)?;
        trainer.engine.upload_model(model)?;
        let planes = if trainer.config.free_space {
            free_space::view_planes(dataset, model, near)
        } else {
            vec![near; trainer.views.len()]
        };
        trainer.views.set_near_planes(&planes);
        trainer.engine.set_shared(&trainer.shared.start(trainer.views.len())?)?;
        // Colour bands that the model lacks start at 0.
        trainer.engine.set_sh_degree(trainer.config.sh_degree);
        trainer.engine.set_antialiased(trainer.config.antialias);
        Ok(trainer)
    }

    fn without_model(
        gpu: Arc<Gpu>,
        config: TrainConfig,
        dataset: &Dataset,
        size: EngineSize,
        TrainerOptions { shape, scheduler, strategy, shared, region, depths }: TrainerOptions,
    ) -> Result<Self> {
        let fixed = Region::scale(region.as_ref(), dataset);
        let shared = shared.or_of(&config, dataset, region.as_ref());
        let strategy = strategy.unwrap_or_else(|| strategy::of(config.strategy));
        let most = if config.max_gaussians > 0 { config.max_gaussians } else { u64::from(u32::MAX) };
        let shape = shape.unwrap_or_else(|| KernelShape::of(gpu.capabilities()));
        let views = setup::train_views(dataset, depths, config.mask_border, size.band(&shape))?;
        let views = Views::new(views, &config);
        let size = size.with_shared_rows(shared.rows(views.len()));
        let mut engine = Engine::with_shape(gpu, shape, size, scheduler)?;
        engine.set_sh_degree(config.sh_degree);
        engine.set_antialiased(config.antialias);
        let image = engine.size().image;
        let passes = shared.passes(strategy.passes(At { step: 1, config: &config, extent: fixed.extent }));
        engine.set_extension(shared.extended(strategy.extension()), passes);
        let order = ViewOrder::new(config.seed, views.parts().len());
        Ok(Self {
            engine,
            config,
            views,
            fixed,
            region,
            order,
            image,
            in_flight: VecDeque::new(),
            step: 0,
            updates: 0,
            bound: Bound { most, by_memory: false },
            strategy,
            shared,
            labelled_once: false,
            separate: separate::Separate::default(),
            timing: None,
            counts_pairs: false,
            seen: sentinel::Seen::default(),
            fingerprints: Vec::new(),
            newest: None,
            densified: None,
        })
    }

    /// Returns the engine, for renders between steps. Nothing may be in flight ([`Trainer::drain`]).
    pub fn engine_mut(&mut self) -> &mut Engine {
        &mut self.engine
    }

    /// Returns the configuration.
    pub fn config(&self) -> &TrainConfig {
        &self.config
    }

    /// Returns the training views.
    pub fn views(&self) -> &[TrainView] {
        &self.views
    }

    /// Returns the number of submitted steps.
    pub fn steps_done(&self) -> u32 {
        self.step
    }

    /// Returns the report of the newest finished step.
    pub fn newest_report(&self) -> Option<StepReport> {
        self.newest
    }

    /// Takes the counts of the last densification; none if they were taken before.
    pub fn take_densified(&mut self) -> Option<Densified> {
        self.densified.take()
    }

    /// Returns the number of Gaussians in the model.
    pub fn gaussian_count(&self) -> u32 {
        self.engine.gaussian_count()
    }

    /// Returns the current degree of the spherical harmonics.
    pub fn sh_degree(&self) -> u32 {
        self.config.sh_degree_at(self.step)
    }

    /// Returns the options of the steps, for previews.
    pub fn render_options(&self) -> RenderOptions {
        let (near, background) = (self.config.near, self.config.background);
        RenderOptions { near, background, sh_degree: Some(self.sh_degree()), ..RenderOptions::default() }
    }

    /// Reads the model back. Steps that failed for lack of memory have not changed it.
    pub fn model(&mut self) -> Result<Gaussians> {
        if let Err(error) = self.drain() {
            if !error.is_out_of_memory() {
                return Err(error);
            }
            self.in_flight.clear();
            self.engine.abandon()?;
        }
        self.engine.download_model()
    }

    /// Submits a step and densifies if the schedule says so. Returns the reports of finished steps; they lag behind,
    /// because two steps are in flight.
    pub fn step(&mut self) -> Result<Vec<StepReport>> {
        let step = self.step + 1;
        let mut done = self.work_before(step)?;
        let input = self.input(step)?;
        if fault::at("nan").is_some() {
            self.engine.spoil()?;
        }
        done.extend(self.submit_next(input.clone())?);
        self.step = step;
        if self.strategy.acts_after(self.at(step)) {
            done.extend(self.drain()?);
            self.refresh_poses()?;
            let uniforms = self.uniforms(&input)?;
            let mut population = Population::new(&mut self.engine, &mut self.bound, &self.views, uniforms, step);
            let at = At { step, config: &self.config, extent: self.fixed.extent };
            self.strategy.act(at, &mut population)?;
            self.densified = population.densified().or(self.densified);
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

    fn input(&mut self, step: u32) -> Result<StepInput> {
        let part = self.order.draw();
        let next = self.order.upcoming(self.views.steps_ahead());
        self.views.prepare(step, part, &next)?;
        let objects = &self.views.parts()[part].objects;
        // A view without a mask, or with an empty one, costs as much as in a scene without masks.
        let labels = self.config.labels_at(step) && !objects.is_empty();
        let layers = if labels && self.config.has_layers_at(step) {
            sampler::sample_objects(self.config.seed, step, objects, self.config.label_samples as usize)
        } else {
            Vec::new()
        };
        let labels = labels && (!layers.is_empty() || self.config.has_disagreement_at(step));
        let update = self.strategy.updates(self.at(step));
        self.updates += u32::from(update);
        Ok(StepInput { step, part, layers, labels, update, updates: self.updates })
    }

    fn at(&self, step: u32) -> At<'_> {
        At { step, config: &self.config, extent: self.fixed.extent }
    }

    /// Returns true if the depth of the model is unreliable before `step`.
    fn blurs_depth_before(&self, step: u32) -> bool {
        step > 1 && self.strategy.blurs_depth_after(self.at(step - 1))
    }

    fn uniforms(&self, input: &StepInput) -> Result<StepUniforms> {
        let view = self.views.of(input)?;
        let mut uniforms = step_input::uniforms(input, view, &self.config, self.fixed, &self.engine);
        if let Some((camera, near)) = self.views.partner(self.config.seed, input) {
            uniforms = self.engine.with_free_space(uniforms, camera, near);
        }
        if let Some(zone) = Region::grow_zone(self.region.as_ref(), &self.config) {
            uniforms = self.engine.with_grow_box(uniforms, &zone);
        }
        self.strategy.uniforms(self.at(input.step), &mut uniforms);
        Ok(uniforms)
    }

    /// Submits a step, and first waits for the oldest one if its frame is still in use.
    fn submit_next(&mut self, input: StepInput) -> Result<Option<StepReport>> {
        let done = if self.in_flight.len() == FRAMES_IN_FLIGHT { self.retire()? } else { None };
        self.submit(input)?;
        Ok(done)
    }

    fn submit(&mut self, input: StepInput) -> Result<()> {
        let (key, view, uniforms) = (self.key(&input), self.views.of(&input)?, self.uniforms(&input)?);
        let shared = self.shared.of_step(self.at(input.step), self.views.index(&input))?;
        let data = step_input::train_input(&input, view, &self.config, uniforms, &self.engine);
        let data = TrainInput { shared, ..data };
        let flight = self.engine.submit(key, &data)?;
        self.in_flight.push_back((input, flight));
        Ok(())
    }

    fn key(&self, input: &StepInput) -> ListKey {
        let variant = Variant {
            labels: !input.layers.is_empty(),
            disagreement: input.labels && input.layers.is_empty(),
            depth: self.config.depth_weight_at(input.step) > 0.0,
            lift: input.lifts(&self.config),
            sh_degree: self.config.sh_degree_at(input.step),
            size: self.views.largest_at(input.step, self.image),
            update: input.update,
            counts: self.counts_pairs,
        };
        if let Some(key) = self.separate.key(variant, input) {
            return key;
        }
        match self.shared.passes(self.strategy.passes(self.at(input.step))) {
            0 => ListKey::Train(variant),
            passes => ListKey::Extended(variant, passes),
        }
    }

    /// Waits for the oldest step in flight. If a buffer was too small, this step and those after it have changed
    /// nothing: the buffer grows and they run again.
    fn retire(&mut self) -> Result<Option<StepReport>> {
        let Some((input, flight)) = self.in_flight.front().cloned() else { return Ok(None) };
        let report = self.engine.retire(&flight)?;
        let recovered = self.engine.recover(&report);
        if recovered.is_err() {
            // These steps have no result and will get none.
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
        self.note_times(input.step, flight.recording)?;
        let view = self.views.of(&input)?;
        let scale = 1.0 / (3.0 * view.valid_pixels.max(1) as f64);
        let (counters, lambda) = (&report.counters, f64::from(step_input::LAMBDA_DSSIM));
        let l1 = f64::from(counters.loss_l1) * scale;
        let ssim = f64::from(counters.loss_ssim) * scale;
        let loss = (1.0 - lambda) * l1 + lambda * (1.0 - ssim);
        let label_loss = step_input::label_loss(&input, view, &self.config, counters.loss_label);
        let kind = StepKind::new(&input, &view, &self.config);
        self.watch(&input, &report, [loss, label_loss])?;
        self.newest = Some(StepReport { step: input.step, loss, l1, ssim, label_loss, kind, report });
        Ok(self.newest)
    }
}
