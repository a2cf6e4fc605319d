//! Exposures of photos: gradient, decision, recovery, checkpoints.

use crate::gradient::differences;
use crate::invariants::training::{config, small};
use crate::reference::exposure::{backward, exposed};
use crate::support::compare::{Tolerance, close};
use crate::support::device;
use labelgs::internals::scheduler::SchedulerOptions;
use labelgs::internals::train::exposure::decided;
use labelgs::internals::train::{TrainState, Trainer};
use labelgs::io::initial_gaussians;
use labelgs::run::{ExposureMode, LabelRule, TrainConfig};
use labelgs::scene::Dataset;

/// The loss sum (c' - t)^2 / 2, which has no kink.
fn loss(image: &[[f64; 3]], logs: [f64; 3], photo: &[[f64; 3]]) -> f64 {
    let all = exposed(image, logs);
    all.as_flattened().iter().zip(photo.as_flattened()).map(|(a, b)| 0.5 * (a - b).powi(2)).sum()
}

#[test]
fn the_mirror_has_the_gradient_of_its_loss() {
    let image: Vec<[f64; 3]> = (0..12).map(|i| [0.05 * f64::from(i), 0.4, 0.9 - 0.06 * f64::from(i)]).collect();
    let photo: Vec<[f64; 3]> = (0..12).map(|i| [0.3, 0.05 * f64::from(i), 0.5]).collect();
    let logs = [0.2, -0.4, 0.1];
    let v: Vec<[f64; 3]> =
        exposed(&image, logs).iter().zip(&photo).map(|(a, b)| [0, 1, 2].map(|c| a[c] - b[c])).collect();
    let (v_image, v_logs) = backward(&image, logs, (&v, &photo), (0.0, [0.0; 3]));
    let numeric = differences(&logs, |p| loss(&image, [p[0], p[1], p[2]], &photo));
    let tolerance = Tolerance { absolute: 1e-8, relative: 1e-6 };
    close(&v_logs, &numeric, tolerance).expect("gradient of the gains");
    let rows = |p: &[f64]| p.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect::<Vec<_>>();
    let numeric = differences(image.as_flattened(), |p| loss(&rows(p), logs, &photo));
    close(v_image.as_flattened(), &numeric, tolerance).expect("gradient of the picture");
}

/// Every second photo is darker.
fn uneven() -> Dataset {
    let mut scene = small();
    for view in scene.train.iter_mut().skip(1).step_by(2) {
        let dark = |value: &mut u8| *value = (f64::from(*value) * 0.6).round() as u8;
        let darken = |[r, g, b, _]: &mut [u8; 4]| [r, g, b].into_iter().for_each(dark);
        let photo = view.photo.as_mut().expect("a photo");
        photo.edit(|photo| photo.rgba.iter_mut().for_each(darken)).expect("in memory");
    }
    scene
}

fn settings(exposure: ExposureMode) -> TrainConfig {
    TrainConfig { iterations: 120, exposure, ..config(LabelRule::Votes) }
}

/// Trains up to a step.
pub fn go_on(trainer: &mut Trainer, until: u32) -> TrainState {
    while trainer.steps_done() < until {
        trainer.step().expect("a step");
    }
    trainer.state().expect("a state")
}

#[test]
fn gains_of_photos_are_found_and_go_on_from_a_checkpoint() {
    let Some(turn) = device() else { return };
    let scene = uneven();
    let start = initial_gaussians(&scene, 0, 100).expect("points");
    let fresh = |exposure| {
        Trainer::new(turn.gpu(), settings(exposure), &scene, &start, SchedulerOptions::default()).expect("a trainer")
    };
    let mut straight = fresh(ExposureMode::On);
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("state");
    go_on(&mut straight, 70).write(&file).expect("a file");
    let expected = go_on(&mut straight, 120);
    let gains: Vec<f32> = straight.exposures().expect("gains").values().map(|gain| gain[0]).collect();
    let bright = gains.iter().step_by(2).copied().fold(f32::MAX, f32::min);
    let dark = gains.iter().skip(1).step_by(2).copied().fold(f32::MIN, f32::max);
    assert!(bright > 1.05 * dark, "{gains:?}");
    let state = TrainState::read(&file).expect("a state");
    let mut resumed = Trainer::resume(turn.gpu(), &scene, state, SchedulerOptions::default()).expect("it goes on");
    assert_eq!(go_on(&mut resumed, 120).planes, expected.planes);
    let mut without = fresh(ExposureMode::Off);
    assert!(go_on(&mut without, 2).shared.is_none() && without.exposures().expect("none").is_empty());
}

#[test]
fn exposure_is_trained_where_photos_differ() {
    let by = |gain: f64| vec![Some([gain, 1.0, 1.0 / gain]), Some([1.0 / gain, 1.0, gain]), None];
    let auto = TrainConfig::default();
    let mode = |gains: &[Option<[f64; 3]>]| decided(&auto, gains).exposure;
    assert_eq!(mode(&by(1.2)), ExposureMode::On);
    assert_eq!(mode(&by(1.02)), ExposureMode::Off);
    assert_eq!(mode(&[]), ExposureMode::Off);
    assert_eq!(mode(&[Some([2.0; 3]), None, None]), ExposureMode::Off, "too few photos are known");
    let on = TrainConfig { exposure: ExposureMode::On, ..auto.clone() };
    assert_eq!(decided(&on, &[]), on);
}
