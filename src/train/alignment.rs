//! Aligns the poses of views with a finished model: the Gaussians stay fixed, the cameras move.
//!
//! If the training photos' poses were refined, the model moved with them, but held-out views keep the poses of the
//! reconstruction. Their scores are only meaningful after their poses were aligned with the model too (as in BARF, Lin
//! et al. 2021).

use crate::error::Result;
use crate::gpu::Gpu;
use crate::scene::{Dataset, Gaussians, Point, View};
use crate::scheduler::SchedulerOptions;
use crate::stage::Stage;
use crate::train::setup::near_plane::sample;
use crate::train::{Objective, TrainConfig, Trainer, TrainerOptions};
use std::sync::Arc;

/// Steps per view.
const STEPS_PER_VIEW: usize = 100;
/// Most Gaussians that represent the scene's points.
const POINTS_MAX: usize = 10_000;

/// Returns the views with poses aligned with a model, which is rendered with `near` and `background`.
pub fn aligned(
    gpu: &Arc<Gpu>,
    model: &Gaussians,
    views: &[&View],
    (near, background): (f32, [f32; 3]),
    scheduler: SchedulerOptions,
) -> Result<Vec<View>> {
    let mut found: Vec<View> = views.iter().map(|&view| view.clone()).collect();
    if found.is_empty() || model.is_empty() {
        return Ok(found);
    }
    let config = TrainConfig {
        iterations: (STEPS_PER_VIEW * found.len()) as u32,
        background,
        refine_poses: true,
        ..TrainConfig::for_finished(model, near)
    };
    let points = sample(model, POINTS_MAX).into_iter().map(|position| Point { position, colour: [0; 3] }).collect();
    let train = found.iter().map(|view| View { mask: None, ..view.clone() }).collect();
    let dataset = Dataset { train, points, ..Dataset::default() };
    let model = Gaussians { labels: None, label_confidence: None, ..model.clone() };
    let options = TrainerOptions { objective: Objective::SHARED, ..scheduler.into() };
    let mut trainer = Trainer::new(Arc::clone(gpu), config, &dataset, &model, options)?;
    let stage = Stage::new("refining poses", trainer.config().iterations as usize);
    for _ in 0..trainer.config().iterations {
        trainer.step()?;
        stage.count();
    }
    trainer.drain()?;
    let refined = trainer.poses()?;
    for view in &mut found {
        if let Some(camera) = refined.get(&view.name) {
            view.camera = camera.clone();
        }
    }
    Ok(found)
}
