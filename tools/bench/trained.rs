//! Trainings that benchmarks start from and time.

use super::measure::{Cost, timed};
use labelgs::Result;
use labelgs::gpu::Gpu;
use labelgs::run::TrainConfig;
use labelgs::scene::{Dataset, Gaussians};
use labelgs::scheduler::SchedulerOptions;
use labelgs::synth::{self, SynthOptions};
use labelgs::train::{StepReport, Trainer, first_model};
use std::sync::Arc;

/// One of this many views of a synthetic scene is held out.
pub const TEST_EVERY: u32 = 8;

/// Runs one step and waits for it. Returns its report and its time. Not for GPU times, because a GPU lowers its clock
/// while it waits.
pub fn timed_step(trainer: &mut Trainer) -> Result<(Vec<StepReport>, Cost)> {
    timed(|| {
        let mut reports = trainer.step()?;
        reports.extend(trainer.drain()?);
        Ok(reports)
    })
}

/// Trains a model of a synthetic scene for a number of steps without masks.
pub fn plain_model(gpu: &Arc<Gpu>, options: &SynthOptions, steps: u32) -> Result<Gaussians> {
    let dataset = without_masks(&synth::dataset(options, TEST_EVERY));
    let config = TrainConfig { iterations: steps, ..TrainConfig::default() };
    let first = first_model(&dataset, &config)?;
    let mut trainer = Trainer::new(Arc::clone(gpu), config, &dataset, &first, SchedulerOptions::default())?;
    for _ in 0..steps {
        trainer.step()?;
    }
    trainer.model()
}

/// Settings for timing: all colour bands and labels from the first step, and nothing between steps after it.
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

/// Returns the scene without masks.
pub fn without_masks(dataset: &Dataset) -> Dataset {
    let mut plain = dataset.clone();
    plain.train.iter_mut().for_each(|view| view.mask = None);
    plain
}
