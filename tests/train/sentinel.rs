//! NaN and overflow in a training: they are counted, named and dropped, and too many end it.

use crate::pass::fixture::{Fixture, PARAMETER_PLANES};
use crate::reference::Rules;
use crate::reference::step::step;
use crate::support::device;
use crate::support::scenes::{Scene, Shape, scene};
use labelgs::Error;
use labelgs::cli::support::exit_status::exit_status;
use labelgs::run::TrainConfig;
use labelgs::scene::Gaussians;
use labelgs::scenes::initial_gaussians;
use labelgs::scheduler::SchedulerOptions;
use labelgs::scheduler::plan::Buf;
use labelgs::synth::{Preset, SynthOptions, dataset};
use labelgs::train::Trainer;

/// A scene with one changed Gaussian in full view.
fn with(change: impl Fn(&mut Gaussians, usize)) -> (Scene, usize) {
    let mut made = scene(221, &Shape { gaussians: 60, ..Shape::default() });
    let row = 17;
    made.gaussians.means[row] = [0.0, 0.0, 4.0];
    made.gaussians.opacities[row] = 1.0;
    made.gaussians.scales[row] = [-2.0, -1.0, -1.5];
    change(&mut made.gaussians, row);
    (made, row)
}

/// A quaternion of length 1e-25 is a valid rotation, but its gradient is 1e25 times as large and its square overflows
/// f32. The Gaussian keeps its parameters in that step, and no other Gaussian is affected.
#[test]
fn only_the_gradient_that_overflows_is_dropped() {
    let Some(turn) = device() else { return };
    let (made, row) = with(|g, row| g.quats[row] = [3e-26, 8e-26, -5e-26, 2e-26]);
    let mut fixture = Fixture::new(turn, made, false);
    fixture.input.update = true;
    let count = fixture.scene.gaussians.len();
    let (model, camera) = (fixture.model(), fixture.scene.camera.clone());
    let mut target = fixture.scene.target.clone();
    target.slots.clear();
    let before = fixture.rows(PARAMETER_PLANES, count);
    let counters = fixture.train().counters;
    assert_eq!((counters.nonfinite_count, counters.nonfinite_first), (1, row as u32));
    assert_eq!((counters.broken_count, counters.unprojected_count), (0, 0));
    let (after, gradients) = (fixture.rows(PARAMETER_PLANES, count), fixture.gradient_rows());
    assert_eq!(before[row], after[row], "without moments, a gradient of 0 moves nothing");
    assert!(gradients[row].floats().iter().all(|value| *value == 0.0));
    let expected = step(&Rules::default(), &camera, &model, &target);
    assert!(expected.rows[row].quat.iter().any(|value| value.abs() > 1e18), "the gradient is as large as that");
    let (mut error, mut size, mut moved) = (0.0, 0.0, 0);
    for other in (0..count).filter(|&other| other != row && expected.margins[other] > 1e-4) {
        for (found, wanted) in gradients[other].floats().iter().zip(expected.rows[other].floats()) {
            error += (found - wanted).powi(2);
            size += wanted.powi(2);
        }
        moved += usize::from(before[other] != after[other]);
    }
    // As the adversaries' bound.
    assert!(
        size > 0.0 && (error / size).sqrt() < 2e-5,
        "the others' gradients are off by {:.1e}",
        (error / size).sqrt()
    );
    assert!(moved > 20, "only {moved} others moved");
}

#[test]
fn the_pass_that_finds_a_broken_parameter_is_counted_by_itself() {
    type Change = fn(&mut Gaussians, usize);
    let cases: [(&str, Change, [u32; 2]); 7] = [
        ("a position", |g, row| g.means[row][1] = f32::NAN, [1, 0]),
        ("an infinite scale", |g, row| g.scales[row][0] = f32::INFINITY, [1, 1]),
        ("an opacity", |g, row| g.opacities[row] = f32::NAN, [1, 0]),
        ("a quaternion", |g, row| g.quats[row][2] = f32::NAN, [0, 1]),
        ("a colour", |g, row| g.sh0[row][0] = f32::NAN, [0, 1]),
        ("a colour less than any", |g, row| g.sh0[row][1] = f32::NEG_INFINITY, [0, 1]),
        ("nothing", |_, _| (), [0, 0]),
    ];
    for (name, change, expected) in cases {
        let Some(turn) = device() else { return };
        let (made, row) = with(change);
        let counters = Fixture::new(turn, made, true).train().counters;
        let found = [counters.broken_count, counters.unprojected_count];
        assert_eq!(found, expected, "{name}");
        let first = [counters.broken_first, counters.unprojected_first];
        (0..2).filter(|&pass| found[pass] > 0).for_each(|pass| assert_eq!(first[pass], row as u32, "{name}"));
    }
}

/// A NaN of the last step, which no pass has checked yet, keeps the checkpoint from being written.
#[test]
fn a_state_with_a_nan_is_refused_as_a_checkpoint() {
    let Some(turn) = device() else { return };
    let options = SynthOptions {
        preset: Preset::Simple,
        width: 48,
        height: 36,
        views: 4,
        points: 300,
        seed: 3,
        ..SynthOptions::default()
    };
    let dataset = dataset(&options, 0);
    let model = initial_gaussians(&dataset, 0, 300).expect("points");
    let config = TrainConfig { iterations: 20, ..TrainConfig::default() };
    let mut trainer =
        Trainer::new(turn.gpu(), config, &dataset, &model, SchedulerOptions::default()).expect("it starts");
    trainer.step().expect("a step");
    let sound = trainer.state().expect("a state");
    for buf in [Buf::QUATS, Buf::M_SH0, Buf::U_MEANS, Buf::DENSIFY_STATS] {
        trainer.engine_mut().raw_mut().upload(buf, 0, 9, &[f32::NAN]).expect("upload");
        let error = trainer.state().expect_err("no state");
        assert!(matches!(error, Error::Numeric { step: 1, .. }), "{error}");
        assert!(error.to_string().contains("is not finite, so there is no checkpoint"), "{error}");
        trainer.restore(&sound).expect("restored");
    }
    assert_eq!(trainer.state().expect("a state").planes, sound.planes);
}

/// More than ten dropped gradients in each of three steps end the training.
#[test]
fn a_training_that_keeps_dropping_gradients_ends() {
    let Some(turn) = device() else { return };
    let run = |broken: usize| -> Result<u32, Error> {
        let options = SynthOptions {
            preset: Preset::Simple,
            width: 48,
            height: 36,
            views: 4,
            points: 300,
            seed: 3,
            ..SynthOptions::default()
        };
        let dataset = dataset(&options, 0);
        let mut model = initial_gaussians(&dataset, 0, 300).expect("points");
        // Spheres have no gradient of rotations.
        model.scales.iter_mut().for_each(|scale| scale[0] += 0.5);
        (0..broken).for_each(|row| model.quats[row] = [1e-25, 2e-25, 0.0, 1e-25]);
        let config = TrainConfig { iterations: 20, ..TrainConfig::default() };
        let mut trainer = Trainer::new(turn.gpu(), config, &dataset, &model, SchedulerOptions::default())?;
        (0..20).try_for_each(|_| trainer.step().map(drop))?;
        trainer.drain()?;
        Ok(trainer.steps_done())
    };
    assert_eq!(run(5).expect("few are borne"), 20);
    let error = run(200).expect_err("many are not");
    assert!(matches!(error, Error::Numeric { step: 3, .. }), "{error}");
    assert!(error.to_string().contains("project_backward dropped the gradients of"), "{error}");
    assert_eq!(exit_status(&error), 8);
}
