//! Steps on photos of half the size.

use crate::support::device;
use labelgs::internals::io::init;
use labelgs::internals::scheduler::SchedulerOptions;
use labelgs::internals::train::{StepReport, Trainer};
use labelgs::run::TrainConfig;
use labelgs::scene::{Dataset, Photo};
use labelgs::synth::{Preset, SynthOptions, dataset};
use std::sync::Arc;

const SCENE: SynthOptions =
    SynthOptions { preset: Preset::Simple, width: 96, height: 72, views: 6, points: 200, seed: 1 };
const COARSE: u32 = 6;

fn steps(gpu: &Arc<labelgs::gpu::Gpu>, data: Dataset, coarse_until: u32) -> Vec<StepReport> {
    let config = TrainConfig { iterations: 100, label_from: 3, coarse_until, ..TrainConfig::default() };
    let model = init::initial_gaussians(&dataset(&SCENE, 0), 0, 100).expect("a model");
    let mut trainer =
        Trainer::new(Arc::clone(gpu), config, &data, &model, SchedulerOptions::default()).expect("a trainer");
    let mut reports = Vec::new();
    for _ in 0..COARSE + 4 {
        reports.extend(trainer.step().expect("a step"));
    }
    reports.extend(trainer.drain().expect("the last steps"));
    reports
}

/// Each pixel the mean of four.
fn half(photo: &Photo) -> Photo {
    let (width, height) = (photo.width / 2, photo.height / 2);
    let at = |x: u32, y: u32, channel: usize| u32::from(photo.rgba[(y * photo.width + x) as usize][channel]);
    let mean = |x: u32, y: u32, c: usize| {
        let sum = at(2 * x, 2 * y, c) + at(2 * x + 1, 2 * y, c) + at(2 * x, 2 * y + 1, c) + at(2 * x + 1, 2 * y + 1, c);
        ((sum + 2) / 4) as u8
    };
    let pixel = |i: u32| [0, 1, 2].map(|c| mean(i % width, i / width, c));
    let rgba = (0..width * height).map(pixel).map(|[r, g, b]| [r, g, b, 255]).collect();
    Photo { width, height, rgba }
}

/// Coarse steps equal those of a scene of half the size without masks. Steps on whole photos, with labels, follow.
#[test]
fn coarse_steps_are_those_of_a_smaller_scene() {
    let Some(gpu) = device() else { return };
    let mut small = dataset(&SCENE, 0);
    for view in &mut small.train {
        view.camera = view.camera.resized(48, 36);
        view.photo = view.photo.as_deref().map(|photo| half(photo).into());
        view.mask = None;
    }
    let (coarse, small) = (steps(&gpu.gpu(), dataset(&SCENE, 0), COARSE), steps(&gpu.gpu(), small, 0));
    for (a, b) in coarse.iter().zip(&small).take(COARSE as usize) {
        // Sums of losses are rounded in another order where there is room for larger pictures.
        assert!((a.loss - b.loss).abs() < 1e-5 * b.loss, "step {}: {} and {}", a.step, a.loss, b.loss);
        assert_eq!((a.step, a.report.counters.visible_count), (b.step, b.report.counters.visible_count));
        assert_eq!(a.label_loss, 0.0, "step {} is without labels", a.step);
    }
    assert!(coarse[COARSE as usize..].iter().all(|report| report.label_loss > 0.0 && report.loss.is_finite()));
    let pixels = |report: &StepReport| report.report.counters.walked_splats();
    assert!(pixels(&coarse[COARSE as usize]) > 2 * pixels(&coarse[COARSE as usize - 1]), "whole photos come after");
}
