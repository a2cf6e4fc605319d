//! Trains per-photo parameters with a custom schedule: exposures that stay fixed in the second half of the run.
//!
//! ```sh
//! cargo run --release --example shared -- SCENE STEPS
//! ```

use labelgs::gpu::{Gpu, GpuOptions};
use labelgs::scenes::{self, LoadOptions};
use labelgs::train::{
    Exposure, Extension, RowOffsets, SharedLayout, SharedParameters, StepContext, TrainConfig, Trainer, TrainerOptions,
    first_model,
};
use std::path::Path;
use std::sync::Arc;

/// Exposures with learning rates in the first half only. Rows, passes and initial values are those of [`Exposure`].
#[derive(Debug, Default)]
struct EarlyExposure(Exposure);

impl SharedParameters for EarlyExposure {
    fn name(&self) -> &'static str {
        self.0.name()
    }

    fn layout(&self) -> SharedLayout {
        self.0.layout()
    }

    fn start(&self, view: Option<usize>) -> Vec<[f32; 4]> {
        self.0.start(view)
    }

    fn rates(&self, at: StepContext) -> Vec<[f32; 4]> {
        let rates = self.0.rates(at);
        if at.step > at.config.iterations / 2 { vec![[0.0; 4]; rates.len()] } else { rates }
    }

    fn extension(&self, place: RowOffsets) -> Arc<dyn Extension> {
        self.0.extension(place)
    }
}

fn main() -> labelgs::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [scene, steps] = &arguments[..] else {
        return Err(labelgs::Error::usage("arguments", "expected: SCENE STEPS"));
    };
    let iterations = steps.parse().map_err(|error| labelgs::Error::usage("STEPS", format!("{error}")))?;
    let scene = scenes::open(Path::new(scene), &LoadOptions::default())?;
    let config = TrainConfig { iterations, ..TrainConfig::default() };
    let model = first_model(&scene, &config)?;
    let options = TrainerOptions { shared: EarlyExposure::default().into(), ..TrainerOptions::default() };
    let mut trainer = Trainer::new(Gpu::new(&GpuOptions::default())?, config, &scene, &model, options)?;
    while trainer.steps_done() < iterations {
        trainer.step()?;
    }
    trainer.drain()?;
    for (photo, [[red, ..], [_, green, _], [.., blue]]) in trainer.exposures()? {
        println!("{photo}: gains of {red:.3}, {green:.3}, {blue:.3}");
    }
    Ok(())
}
