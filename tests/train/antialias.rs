//! Trainings without aliasing.

use crate::support::device;
use crate::train::exposure::go_on;
use labelgs::run::{StrategyKind, TrainConfig};
use labelgs::scheduler::SchedulerOptions;
use labelgs::synth;
use labelgs::synth::{Preset, SynthOptions};
use labelgs::train::state::TrainState;
use labelgs::train::{Trainer, first_model};

/// No Gaussian is finer than its limit, which densification hands on; a resumed training has the same bits.
#[test]
fn gaussians_stay_smooth_and_go_on_from_a_checkpoint() {
    let Some(turn) = device() else { return };
    let (preset, views, points) = (Preset::Simple, 12, 400);
    let options = SynthOptions { preset, width: 64, height: 48, views, points, seed: 5, ..SynthOptions::default() };
    let scene = synth::dataset(&options, 8);
    for strategy in [StrategyKind::Budget, StrategyKind::Mcmc, StrategyKind::Adc] {
        let config = TrainConfig { iterations: 90, antialias: true, strategy, ..TrainConfig::default() };
        let mut start = first_model(&scene, &config).expect("a model");
        // Far below a pixel.
        start.scales.iter_mut().for_each(|scale| *scale = scale.map(|value| value - 4.0));
        let mut straight =
            Trainer::new(turn.gpu(), config, &scene, &start, SchedulerOptions::default()).expect("a trainer");
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("state");
        go_on(&mut straight, 50).write(&file).expect("a file");
        let expected = go_on(&mut straight, 90);
        let scales = expected.planes.iter().find(|plane| plane.name == "scales").expect("scales");
        let rows: Vec<[f32; 4]> =
            scales.data.chunks_exact(4).map(|row| [0, 1, 2, 3].map(|at| f32::from_bits(row[at]))).collect();
        let limited = rows.iter().filter(|row| row[3] > 0.0).count();
        assert!(limited * 10 > rows.len() * 9, "{strategy:?}: {limited} of {} have a limit", rows.len());
        let least = rows.iter().map(|row| row[3]).filter(|&limit| limit > 0.0).fold(f32::MAX, f32::min);
        let fine = start.scales.iter().filter(|row| row.iter().all(|scale| scale.exp() < least)).count();
        assert!(fine * 2 > start.len(), "{strategy:?}: {fine} of {} were too fine", start.len());
        let fine = rows.iter().find(|row| row[3] > 0.0 && row[..3].iter().any(|&scale| scale < row[3].ln() - 1e-5));
        assert_eq!(fine, None, "{strategy:?}");
        assert!(straight.model().expect("a model").antialiased);
        let state = TrainState::read(&file).expect("a state");
        let mut resumed = Trainer::resume(turn.gpu(), &scene, state, SchedulerOptions::default()).expect("it goes on");
        assert_eq!(go_on(&mut resumed, 90).planes, expected.planes, "{strategy:?}");
    }
}
