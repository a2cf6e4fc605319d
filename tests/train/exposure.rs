//! Exposures of photos: gradient, decision, recovery, checkpoints.

use crate::invariants::training::{config, small};
use crate::reference::exposure::{ExposureRows, backward, exposed};
use crate::support::compare::{Tolerance, close};
use crate::support::device;
use crate::verify::gradient::differences;
use labelgs::run::{ExposureMode, LabelRule, TrainConfig};
use labelgs::scene::{ColourMatrix, Dataset};
use labelgs::scenes::initial_gaussians;
use labelgs::scheduler::SchedulerOptions;
use labelgs::train::Trainer;
use labelgs::train::shared::exposure::decided;
use labelgs::train::state::TrainState;

/// The loss sum (c' - t)^2 / 2, which has no kink.
fn loss(image: &[[f64; 3]], rows: &ExposureRows, photo: &[[f64; 3]]) -> f64 {
    let all = exposed(image, rows);
    all.as_flattened().iter().zip(photo.as_flattened()).map(|(a, b)| 0.5 * (a - b).powi(2)).sum()
}

#[test]
fn the_mirror_has_the_gradient_of_its_loss() {
    let image: Vec<[f64; 3]> = (0..12).map(|i| [0.05 * f64::from(i), 0.4, 0.9 - 0.06 * f64::from(i)]).collect();
    let photo: Vec<[f64; 3]> = (0..12).map(|i| [0.3, 0.05 * f64::from(i), 0.5]).collect();
    let rows = [[0.2, -0.4, 0.1], [0.1, -0.2, 0.3], [0.05, 0.2, -0.1]];
    let v: Vec<[f64; 3]> =
        exposed(&image, &rows).iter().zip(&photo).map(|(a, b)| [0, 1, 2].map(|c| a[c] - b[c])).collect();
    let (v_image, v_rows) = backward(&image, &rows, (&v, &photo), (0.0, &[[0.0; 3]; 3]));
    let threes = |p: &[f64]| p.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect::<Vec<_>>();
    let numeric =
        differences(rows.as_flattened(), |p| loss(&image, &threes(p).try_into().expect("three rows"), &photo));
    let tolerance = Tolerance { absolute: 1e-8, relative: 1e-6 };
    close(v_rows.as_flattened(), &numeric, tolerance).expect("gradient of the rows");
    let numeric = differences(image.as_flattened(), |p| loss(&threes(p), &rows, &photo));
    close(v_image.as_flattened(), &numeric, tolerance).expect("gradient of the picture");
}

/// Every second photo has other colours.
fn uneven(other: fn([f64; 3]) -> [f64; 3]) -> Dataset {
    let mut scene = small();
    for view in scene.train.iter_mut().skip(1).step_by(2) {
        let change = |texel: &mut [u8; 4]| {
            let colour = other([0, 1, 2].map(|c| f64::from(texel[c])));
            colour.into_iter().zip(texel).for_each(|(c, value)| *value = c.round() as u8);
        };
        let photo = view.photo.as_mut().expect("a photo");
        photo.edit(|photo| photo.rgba.iter_mut().for_each(change)).expect("in memory");
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

/// Returns a value of the matrices of each second photo, from the first and from the second on.
fn halves(trainer: &mut Trainer, of: fn(&ColourMatrix) -> f32) -> (Vec<f32>, Vec<f32>) {
    let found: Vec<f32> = trainer.exposures().expect("matrices").values().map(of).collect();
    (found.iter().step_by(2).copied().collect(), found.iter().skip(1).step_by(2).copied().collect())
}

/// Light of another colour does not only change gains. Compared with a training on the photos as they were, because
/// what each of these five photos shows makes shares as well.
#[test]
fn a_channel_that_takes_of_another_one_is_found() {
    let Some(turn) = device() else { return };
    let taken = |other| {
        let scene = uneven(other);
        let start = initial_gaussians(&scene, 0, 100).expect("points");
        let config = settings(ExposureMode::On);
        let mut trainer =
            Trainer::new(turn.gpu(), config, &scene, &start, SchedulerOptions::default()).expect("a trainer");
        go_on(&mut trainer, 120);
        halves(&mut trainer, |matrix| matrix[0][2] / matrix[0].iter().sum::<f32>())
    };
    let (plain, mixed) = (taken(|colour| colour), taken(|[r, g, b]| [0.7 * r + 0.3 * b, g, b]));
    let more = |(mixed, plain): (&f32, &f32)| mixed - plain;
    let own = mixed.0.iter().zip(&plain.0).map(more).fold(f32::MIN, f32::max);
    let taken = mixed.1.iter().zip(&plain.1).map(more).fold(f32::MAX, f32::min);
    assert!(taken > own + 0.008, "{taken} {own}");
}

#[test]
fn gains_of_photos_are_found_and_go_on_from_a_checkpoint() {
    let Some(turn) = device() else { return };
    let scene = uneven(|colour| colour.map(|c| 0.6 * c));
    let start = initial_gaussians(&scene, 0, 100).expect("points");
    let fresh = |exposure| {
        Trainer::new(turn.gpu(), settings(exposure), &scene, &start, SchedulerOptions::default()).expect("a trainer")
    };
    let mut straight = fresh(ExposureMode::On);
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("state");
    go_on(&mut straight, 90).write(&file).expect("a file");
    let expected = go_on(&mut straight, 120);
    let (bright, dark) = halves(&mut straight, |matrix| matrix[0].iter().sum());
    let (bright, dark) = (bright.into_iter().fold(f32::MAX, f32::min), dark.into_iter().fold(f32::MIN, f32::max));
    assert!(bright > 1.05 * dark, "{bright} {dark}");
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
