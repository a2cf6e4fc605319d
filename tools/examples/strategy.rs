//! Trains with a custom strategy: Gaussians never grow, and faint ones are removed. An extra pass clears the momentum
//! of positions.
//!
//! ```sh
//! cargo run --release --example strategy -- SCENE STEPS OUT.ply
//! ```

use labelgs::formats;
use labelgs::gpu::{Gpu, GpuOptions};
use labelgs::scenes::{self, LoadOptions};
use labelgs::train::{
    Buf, Builder, Extension, Hook, Population, StepContext, StepUniforms, Strategy, TrainConfig, Trainer,
    TrainerOptions, first_model,
};
use std::path::Path;
use std::sync::Arc;

/// Removes faint Gaussians after every hundredth step.
#[derive(Debug)]
struct Thinning;

impl Strategy for Thinning {
    fn name(&self) -> &'static str {
        "thinning"
    }

    fn acts_after(&self, at: StepContext) -> bool {
        !at.is_last() && at.step.is_multiple_of(100)
    }

    fn act(&mut self, at: StepContext, population: &mut Population) -> labelgs::Result<()> {
        // Without a threshold, nothing grows.
        let uniforms = StepUniforms { densify_threshold: 0.0, prune_opacity: 0.02, ..population.uniforms() };
        let counts = population.densify(uniforms, u64::MAX)?;
        println!("step {}: {} Gaussians removed, {} left", at.step, counts.pruned, population.count());
        Ok(())
    }

    fn extension(&self) -> Arc<dyn Extension> {
        Arc::new(ClearMomentum)
    }

    /// Each number is a variant of the step, recorded separately; 0 has no passes of the extension.
    fn passes(&self, at: StepContext) -> u32 {
        u32::from(at.step > at.config.iterations / 2)
    }
}

/// Clears the first moments of positions after an update.
#[derive(Debug)]
struct ClearMomentum;

impl Extension for ClearMomentum {
    fn extend(&self, _passes: u32, hook: Hook, b: &mut Builder) {
        if hook == Hook::Updated {
            b.list.fill(Buf::M_MEANS, 0);
        }
    }
}

fn main() -> labelgs::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [scene, steps, out] = &arguments[..] else {
        return Err(labelgs::Error::usage("arguments", "expected: SCENE STEPS OUT.ply"));
    };
    let iterations = steps.parse().map_err(|error| labelgs::Error::usage("STEPS", format!("{error}")))?;
    let scene = scenes::open(Path::new(scene), &LoadOptions::default())?;
    let config = TrainConfig { iterations, ..TrainConfig::default() };
    let model = first_model(&scene, &config)?;
    let options = TrainerOptions { strategy: Some(Box::new(Thinning)), ..TrainerOptions::default() };
    let mut trainer = Trainer::new(Gpu::new(&GpuOptions::default())?, config, &scene, &model, options)?;
    while trainer.steps_done() < iterations {
        trainer.step()?;
    }
    trainer.drain()?;
    if let Some(report) = trainer.newest_report() {
        println!("step {}: loss {:.4}", report.step, report.loss);
    }
    formats::write_model(out, &trainer.model()?)?;
    Ok(())
}
