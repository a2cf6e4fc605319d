//! State shared by training steps and the jobs between them.

use crate::engine::{Engine, EngineSize, InFlight, ListKey, TrainInput};
use crate::error::Result;
use crate::gpu::Gpu;
use crate::pass::{KernelShape, Variant};
use crate::scene::{Dataset, Zone};
use crate::shaders::structs::StepUniforms;
use crate::train::TrainConfig;
use crate::train::extension::JoinedExtension;
use crate::train::input::step_input::{self, SceneScale, StepInput};
use crate::train::input::views::Views;
use crate::train::objective::{Loss, Objective};
use crate::train::setup::{self, TrainerOptions};
use crate::train::shared::SharedSet;
use crate::train::shared::poses;
use crate::train::strategy::{StepContext, Strategy};
use std::sync::Arc;

/// The model on the device, and everything it is trained with.
pub(super) struct Context {
    pub(super) engine: Engine,
    pub(super) config: TrainConfig,
    pub(super) objective: Objective,
    pub(super) strategy: Box<dyn Strategy>,
    pub(super) shared: SharedSet,
    pub(super) views: Views,
    /// True if the photos show objects alone.
    pub(super) objects_only: bool,
    scale: SceneScale,
    /// Zone in which Gaussians grow; `None` for everywhere.
    grow_zone: Option<Zone>,
    /// Size of the largest photo part, px. The engine's image may be larger, because it can grow.
    image: (u32, u32),
    /// 1 if every step has passes of shared parameters or of the objective.
    always_passes: u32,
    /// True if blend passes count contributing pairs.
    pub(super) counts_pairs: bool,
    /// Input of the newest step.
    pub(super) newest: Option<StepInput>,
}

impl Context {
    /// Opens an engine for training on a data set. The model is not uploaded yet.
    pub(super) fn new(
        gpu: Arc<Gpu>,
        config: TrainConfig,
        dataset: &Dataset,
        size: EngineSize,
        TrainerOptions { shape, scheduler, objective, strategy, shared, region, depths }: TrainerOptions,
    ) -> Result<Self> {
        let region = region.as_ref();
        let scale = SceneScale { extent: region.map_or_else(|| dataset.extent(), |region| region.extent) };
        let grow_zone = region.map(|region| region.zone).or(config.grow_box.map(Zone::along_world));
        let shared = shared.or_of(&config, dataset, region);
        let strategy = strategy.unwrap_or_else(|| objective.strategy(config.strategy));
        let shape = shape.unwrap_or_else(|| KernelShape::for_device(gpu.capabilities()));
        let views = setup::train_views(dataset, depths, config.mask_border, size.band(&shape))?;
        let views = Views::new(views, &config, scheduler.limits(&gpu).frames);
        let size = size.with_shared_rows(shared.rows(views.len()));
        let mut engine = Engine::with_shape(gpu, shape, size, scheduler)?;
        engine.set_sh_degree(config.sh_degree);
        engine.set_antialiased(config.antialias);
        let image = engine.size().image;
        let always: Vec<_> = objective.extension().into_iter().chain(shared.extensions()).collect();
        let always_passes = u32::from(!always.is_empty());
        let passes = strategy.passes(StepContext { step: 1, config: &config, extent: scale.extent }) + always_passes;
        engine.set_extension(JoinedExtension::join(strategy.extension(), always), passes);
        Ok(Self {
            engine,
            config,
            objective,
            strategy,
            shared,
            views,
            objects_only: dataset.objects_only,
            scale,
            grow_zone,
            image,
            always_passes,
            counts_pairs: false,
            newest: None,
        })
    }

    /// Returns a step's context for strategies and shared parameters.
    pub(super) fn step_context(&self, step: u32) -> StepContext<'_> {
        StepContext { step, config: &self.config, extent: self.scale.extent }
    }

    /// Returns true if the depth of the model is unreliable before `step`.
    pub(super) fn blurs_depth_before(&self, step: u32) -> bool {
        step > 1 && self.strategy.blurs_depth_after(self.step_context(step - 1))
    }

    /// Returns true if Gaussians have labels: in a scene with masks.
    pub(super) fn has_labels(&self) -> bool {
        self.engine.size().labels.is_some()
    }

    pub(super) fn uniforms(&self, input: &StepInput) -> Result<StepUniforms> {
        let view = self.views.step_view(input)?;
        let mut uniforms = step_input::uniforms(input, view, &self.config, self.scale, &self.engine);
        if let Some((camera, near)) = self.views.partner(self.config.seed, input) {
            uniforms = self.engine.with_free_space(uniforms, camera, near);
        }
        if let Some(zone) = &self.grow_zone {
            uniforms = self.engine.with_grow_box(uniforms, zone);
        }
        self.strategy.uniforms(self.step_context(input.step), &mut uniforms);
        self.objective.limit_rates(&mut uniforms);
        Ok(uniforms)
    }

    pub(super) fn submit(&mut self, input: &StepInput) -> Result<InFlight> {
        let (key, view, uniforms) = (self.key(input), self.views.step_view(input)?, self.uniforms(input)?);
        let shared = self.shared.step_rows(self.step_context(input.step), self.views.index(input))?;
        let data = step_input::train_input(input, view, &self.config, uniforms, &self.engine);
        let flight = self.engine.submit(key, &TrainInput { shared, ..data })?;
        self.newest = Some(input.clone());
        Ok(flight)
    }

    fn key(&self, input: &StepInput) -> ListKey {
        let variant = Variant {
            supervision: input.supervision(&self.config),
            sh_degree: self.config.sh_degree_at(input.step),
            size: self.views.largest_at(input.step, self.image),
            update: input.update,
            counts: self.counts_pairs,
            catch_up: false,
        };
        match self.strategy.passes(self.step_context(input.step)) + self.always_passes {
            0 => ListKey::Train(variant),
            passes => ListKey::Extended(variant, passes),
        }
    }

    /// Returns the lists that this training may need, ordered by their first steps.
    pub(super) fn lists_ahead(&self) -> Vec<ListKey> {
        let mut keys = Vec::new();
        for step in 1..=self.config.iterations {
            let update = self.strategy.updates(self.step_context(step));
            let plain = StepInput { step, part: 0, layers: Vec::new(), labels: false, update, updates: step };
            let disagrees =
                self.has_labels() && self.objective.has(Loss::Disagreement) && self.config.has_disagreement_at(step);
            let layered = self.has_labels() && self.objective.has(Loss::Layers) && self.config.has_layers_at(step);
            let labelled = disagrees.then(|| StepInput { labels: true, ..plain.clone() });
            let layered = layered.then(|| StepInput { labels: true, layers: vec![1], ..plain.clone() });
            for input in [plain].into_iter().chain(labelled).chain(layered) {
                let key = self.key(&input);
                if !keys.contains(&key) {
                    keys.push(key);
                }
            }
        }
        let growth = [ListKey::DensifyCount, ListKey::DensifyApply, ListKey::OpacityReset];
        let catch_up = self.engine.may_be_late().then_some(ListKey::CatchUp);
        let first = 1.min(keys.len());
        keys.splice(first..first, growth.into_iter().chain(catch_up));
        keys
    }

    /// Returns an owner's rows of each photo; `None` without this owner. Nothing may be in flight.
    pub(super) fn photo_rows(&mut self, owner: &str) -> Result<Vec<Vec<[f32; 4]>>> {
        let Some(range) = self.shared.photo_rows(owner) else { return Ok(Vec::new()) };
        let rows = self.engine.shared()?;
        let of = |view: usize| rows[self.shared.view_range(view)][range.clone()].to_vec();
        Ok((0..self.views.len()).map(of).collect())
    }

    /// Applies the refined poses to jobs between steps. Nothing may be in flight.
    pub(super) fn refresh_poses(&mut self) -> Result<()> {
        let rows = self.photo_rows(poses::POSES_NAME)?;
        self.views.refine(&rows);
        Ok(())
    }
}
