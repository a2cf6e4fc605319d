//! A buffer that is too small costs a lost step, never a wrong update.

use crate::support::device;
use labelgs::run::TrainConfig;
use labelgs::scene::Gaussians;
use labelgs::scenes::init;
use labelgs::scheduler::SchedulerOptions;
use labelgs::synth::{Preset, SynthLens, SynthOptions, dataset};
use labelgs::train::Trainer;

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

/// Model after a few labelled steps with initial capacity `room`, and whether the (splat, tile) pairs had to grow.
fn trained(gpu: &std::sync::Arc<labelgs::gpu::Gpu>, room: u64) -> (Gaussians, bool) {
    let data = dataset(&SCENE_OPTIONS, 0);
    let config = TrainConfig { iterations: 100, label_from: Some(3), start_size: Some(1.0), ..TrainConfig::default() };
    let mut model = init::initial_gaussians(&data, 0, 100).expect("a model");
    // Large and opaque: many tiles each, and labels at once.
    model.scales.iter_mut().flatten().for_each(|scale| *scale = -1.2);
    model.opacities.iter_mut().for_each(|logit| *logit = 2.0);
    let mut trainer =
        Trainer::new(std::sync::Arc::clone(gpu), config, &data, &model, SchedulerOptions::default()).expect("trainer");
    trainer.engine_mut().make_room_for_gaussians(room).expect("room");
    let before = trainer.engine_mut().capacity().instances;
    for _ in 0..6 {
        trainer.step().expect("a step");
    }
    let model = trainer.model().expect("a model");
    (model, before != trainer.engine_mut().capacity().instances)
}

#[test]
fn a_run_that_overflows_equals_a_run_with_room() {
    let Some(gpu) = device() else { return };
    let (small, grew) = trained(&gpu.gpu(), 1);
    let (large, grew_large) = trained(&gpu.gpu(), 60_000);
    assert!(grew && !grew_large, "the scene must overflow the small memory ({grew}), not the large one ({grew_large})");
    assert_eq!(small, large);
}
