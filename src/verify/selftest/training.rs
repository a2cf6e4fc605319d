//! Runs a short training twice.

use super::compare::{Verdict, exact};
use crate::error::Result;
use crate::gpu::Gpu;
use crate::pass::KernelShape;
use crate::scene::Gaussians;
use crate::scenes::initial_gaussians;
use crate::synth::{self, Preset, SynthOptions};
use crate::train::{TrainConfig, Trainer, TrainerOptions};
use std::sync::Arc;

const TRAINING_STEPS: u32 = 80;

/// Checks that 80 steps with votes and three densifications give the same bits twice, and a smaller loss.
pub(super) fn twice(gpu: &Arc<Gpu>, kernels: KernelShape) -> Result<Verdict> {
    let (first, loss) = train(gpu, kernels)?;
    let (second, _) = train(gpu, kernels)?;
    let [before, after] = loss;
    if !(after < 0.7 * before) {
        return Ok(Err(format!(
            "the loss changes from {before:.4} to {after:.4} in {TRAINING_STEPS} steps; expected a smaller loss"
        )));
    }
    let bits = |model: &Gaussians| -> Vec<u32> {
        let floats = |rows: &[[f32; 3]]| rows.as_flattened().iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        let mut all =
            [floats(&model.means), floats(&model.scales), floats(&model.sh0), floats(&model.sh_rest)].concat();
        all.extend(model.quats.as_flattened().iter().chain(&model.opacities).map(|v| v.to_bits()));
        all.extend(model.labels.iter().flatten());
        all
    };
    Ok(exact(&bits(&second), &bits(&first)))
}

/// Trains; returns the model, and the mean loss of the first and of the last ten steps.
fn train(gpu: &Arc<Gpu>, kernels: KernelShape) -> Result<(Gaussians, [f64; 2])> {
    let options = SynthOptions {
        preset: Preset::Simple,
        width: 72,
        height: 52,
        views: 6,
        points: 400,
        seed: 3,
        ..SynthOptions::default()
    };
    let dataset = synth::dataset(&options, 0);
    let config = TrainConfig {
        iterations: TRAINING_STEPS,
        start_size: Some(1.0),
        label_from: Some(10),
        vote_every: Some(20),
        densify_from: Some(15),
        densify_until: Some(TRAINING_STEPS),
        densify_interval: Some(20),
        densify_grad_threshold: 5e-5,
        ..TrainConfig::default()
    };
    let model = initial_gaussians(&dataset, config.seed, 100)?;
    let options = TrainerOptions { shape: Some(kernels), ..TrainerOptions::default() };
    let mut trainer = Trainer::new(Arc::clone(gpu), config, &dataset, &model, options)?;
    let mut reports = Vec::new();
    for _ in 0..TRAINING_STEPS {
        reports.extend(trainer.step()?);
    }
    reports.extend(trainer.drain()?);
    let mean = |steps: &[crate::train::StepReport]| {
        steps.iter().map(|report| report.loss).sum::<f64>() / steps.len().max(1) as f64
    };
    let ten = reports.len().min(10);
    let losses = [mean(&reports[..ten]), mean(&reports[reports.len() - ten..])];
    Ok((trainer.labelled_model()?, losses))
}
