//! Trainings that benchmarks start from and time.

use super::measure::{Cost, timed};
use labelgs::Result;
use labelgs::edit::MIN_LABEL_CONFIDENCE;
use labelgs::engine::{Engine, EngineSize};
use labelgs::eval::MeanScores;
use labelgs::eval::{Rendering, evaluate};
use labelgs::gpu::Gpu;
use labelgs::internals::scheduler::SchedulerOptions;
use labelgs::internals::train::{StepReport, Trainer, first_model};
use labelgs::render::{NEAR, RenderOptions};
use labelgs::run::TrainConfig;
use labelgs::scene::{Dataset, Gaussians, View};
use labelgs::synth;
use labelgs::synth::{Preset, SynthOptions};
use std::sync::Arc;

/// Trainings on the built-in scene: options of several benchmarks.
#[derive(clap::Args, Clone, Debug)]
pub struct Trainings {
    /// Steps of a training.
    #[arg(long, default_value_t = 1700)]
    steps: u32,
    /// Seeds of the trainings.
    #[arg(long, value_delimiter = ',', default_values_t = [0_u64, 1, 2])]
    seeds: Vec<u64>,
    /// Width of the photos, px.
    #[arg(long, default_value_t = 320)]
    width: u32,
}

impl Trainings {
    /// The scene, the steps of a training, and the seeds.
    pub fn plan(&self, small: bool) -> (SynthOptions, u32, &[u64]) {
        match small {
            true => (small_scene(), 30, &self.seeds[..1]),
            false => {
                let made = SynthOptions { width: self.width, height: self.width * 3 / 4, ..SynthOptions::default() };
                (made, self.steps, &self.seeds)
            }
        }
    }
}

/// One view in this many of a made scene is held out.
pub const TEST_EVERY: u32 = 8;

/// A scene with steps of milliseconds.
pub fn small_scene() -> SynthOptions {
    SynthOptions {
        preset: Preset::Simple,
        width: 72,
        height: 52,
        views: 5,
        points: 300,
        seed: 3,
        ..SynthOptions::default()
    }
}

/// The model that a training of the scene starts from.
pub fn start(dataset: &Dataset, config: &TrainConfig) -> Result<Gaussians> {
    first_model(dataset, config)
}

/// A trainer on a copy of the scene.
pub fn trainer(gpu: &Arc<Gpu>, dataset: &Dataset, model: &Gaussians, config: TrainConfig) -> Result<Trainer> {
    Trainer::new(Arc::clone(gpu), config, dataset, model, SchedulerOptions::default())
}

/// Runs one step and waits for it; returns its report and its time.
pub fn timed_step(trainer: &mut Trainer) -> Result<(Vec<StepReport>, Cost)> {
    timed(|| {
        let mut reports = trainer.step()?;
        reports.extend(trainer.drain()?);
        Ok(reports)
    })
}

/// Model of a made scene after a number of steps without masks.
pub fn plain_model(gpu: &Arc<Gpu>, options: &SynthOptions, steps: u32) -> Result<Gaussians> {
    let dataset = without_masks(&synth::dataset(options, TEST_EVERY));
    let config = TrainConfig { iterations: steps, ..TrainConfig::default() };
    trained(gpu, &dataset, config)?.model()
}

/// A trainer after all of its steps.
pub fn trained(gpu: &Arc<Gpu>, dataset: &Dataset, config: TrainConfig) -> Result<Trainer> {
    let steps = config.iterations;
    let mut trainer = trainer(gpu, dataset, &start(dataset, &config)?, config)?;
    for _ in 0..steps {
        trainer.step()?;
    }
    Ok(trainer)
}

/// A labelled model after a number of steps.
pub fn labelled_model(gpu: &Arc<Gpu>, dataset: &Dataset, steps: u32) -> Result<Gaussians> {
    let steps = steps.max(1);
    let config = TrainConfig {
        iterations: steps + 1,
        label_from: Some(steps.div_ceil(2)),
        start_size: Some(1.0),
        ..TrainConfig::default()
    };
    let mut trainer = trainer(gpu, dataset, &start(dataset, &config)?, config)?;
    for _ in 0..steps {
        trainer.step()?;
    }
    trainer.labelled_model()
}

/// Settings for timing: all bands of colour and labels from the first step, and nothing between the steps after it.
pub fn timing_config() -> TrainConfig {
    TrainConfig {
        iterations: u32::MAX,
        label_from: Some(1),
        vote_every: Some(u32::MAX),
        occlusion_every: Some(u32::MAX),
        sh_degree_interval: Some(1),
        densify_from: Some(u32::MAX),
        densify_until: Some(u32::MAX),
        opacity_reset_interval: 0,
        start_size: Some(1.0),
        ..TrainConfig::default()
    }
}

/// The scene without masks.
pub fn without_masks(dataset: &Dataset) -> Dataset {
    let mut plain = dataset.clone();
    plain.train.iter_mut().for_each(|view| view.mask = None);
    plain
}

/// Renders held-out views of models and scores them, on memory of its own.
pub struct Judge {
    engine: Engine,
}

impl Judge {
    /// For the views of a scene.
    pub fn new(gpu: &Arc<Gpu>, dataset: &Dataset) -> Result<Self> {
        let sizes = dataset.test.iter().map(|view| (view.camera.width, view.camera.height));
        let size = sizes.reduce(|a, b| (a.0.max(b.0), a.1.max(b.1))).unwrap_or((1, 1));
        let room = EngineSize::new(1, size);
        Ok(Self { engine: Engine::new(Arc::clone(gpu), room, SchedulerOptions::default())? })
    }

    /// Scores on the held-out views, as `labelgs eval` gives them.
    pub fn scores(&mut self, dataset: &Dataset, model: &Gaussians, config: &TrainConfig) -> Result<MeanScores> {
        let views: Vec<&View> = dataset.test.iter().collect();
        let near = if config.near > 0.0 { config.near } else { NEAR };
        let options = RenderOptions { near, background: config.background, ..RenderOptions::default() };
        let how = Rendering { options, min_confidence: MIN_LABEL_CONFIDENCE, train: &[], by_main: false, lpips: None };
        Ok(evaluate(&mut self.engine, model, &views, how, &(), &mut ())?.mean)
    }
}
