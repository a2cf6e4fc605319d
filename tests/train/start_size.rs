//! Steps on small photos.

use crate::support::device;
use labelgs::run::TrainConfig;
use labelgs::scene::{Dataset, Photo};
use labelgs::scenes::init;
use labelgs::scheduler::SchedulerOptions;
use labelgs::synth::{Preset, SynthLens, SynthOptions, dataset};
use labelgs::train::{StepReport, Trainer};
use std::sync::Arc;

const SCENE_OPTIONS: SynthOptions = SynthOptions {
    preset: Preset::Simple,
    width: 96,
    height: 72,
    views: 6,
    points: 200,
    seed: 1,
    lens: SynthLens::PINHOLE,
    fov: None,
    vary_exposure: false,
};
/// Steps at half of the size.
const COARSE_STEPS: u32 = 6;

/// Runs steps of a training that starts at a share of the size; full size comes at `full_size_from`.
fn steps(gpu: &Arc<labelgs::gpu::Gpu>, data: Dataset, start_size: f32, full_size_from: u32) -> Vec<StepReport> {
    let (label_from, start_size, full_size_from) = (Some(3), Some(start_size), Some(full_size_from));
    let config = TrainConfig { iterations: 100, label_from, start_size, full_size_from, ..TrainConfig::default() };
    let model = init::initial_gaussians(&dataset(&SCENE_OPTIONS, 0), 0, 100).expect("a model");
    let mut trainer =
        Trainer::new(Arc::clone(gpu), config, &data, &model, SchedulerOptions::default()).expect("a trainer");
    let mut reports = Vec::new();
    for _ in 0..COARSE_STEPS + 4 {
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

/// Coarse steps equal those of a scene of half the size without masks.
#[test]
fn coarse_steps_are_those_of_a_smaller_scene() {
    let Some(gpu) = device() else { return };
    let mut small = dataset(&SCENE_OPTIONS, 0);
    for view in &mut small.train {
        view.camera = view.camera.resized(48, 36);
        view.photo = Some(half(&view.photo().expect("a photo")).into());
        view.mask = None;
    }
    // The first of eight sizes lasts for an eighth of the steps below full size.
    let coarse = steps(&gpu.gpu(), dataset(&SCENE_OPTIONS, 0), 0.5, 8 * (COARSE_STEPS + 1));
    let small = steps(&gpu.gpu(), small, 1.0, 0);
    for (a, b) in coarse.iter().zip(&small).take(COARSE_STEPS as usize) {
        // Sums of losses are rounded in another order where there is room for larger pictures.
        assert!((a.loss - b.loss).abs() < 1e-5 * b.loss, "step {}: {} and {}", a.step, a.loss, b.loss);
        assert_eq!((a.step, a.report.counters.visible_count), (b.step, b.report.counters.visible_count));
        assert_eq!(a.label_loss, 0.0, "step {} is without labels", a.step);
    }
}

/// The photos grow from step to step up to full size; from there on steps have labels.
#[test]
fn photos_grow_to_their_full_size() {
    let Some(gpu) = device() else { return };
    let reports = steps(&gpu.gpu(), dataset(&SCENE_OPTIONS, 0), 0.25, COARSE_STEPS);
    let walked = |report: &StepReport| report.report.counters.walked_splats();
    assert!(walked(&reports[COARSE_STEPS as usize]) > 4 * walked(&reports[0]), "the first pictures are small");
    for (report, step) in reports.iter().zip(1..) {
        // The first step with labels has object layers, and every second one the disagreement of labels.
        let has_labels = step == COARSE_STEPS || (step > COARSE_STEPS && (step - COARSE_STEPS) % 2 == 1);
        assert_eq!(report.label_loss > 0.0, has_labels, "labels in step {step}");
        assert!(report.loss.is_finite());
    }
}
