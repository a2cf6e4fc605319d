//! Poses of photos: gradient, recovery, checkpoints.

use crate::reference::Rules;
use crate::reference::pose::{PoseRows, backward, corrected};
use crate::reference::step::step;
use crate::support::device;
use crate::support::scenes::{Shape, scene};
use crate::train::exposure::go_on;
use crate::verify::gradient::{agree, differences};
use glam::{DQuat, DVec3};
use labelgs::run::{ExposureMode, TrainConfig};
use labelgs::scene::{Camera, Point, View};
use labelgs::scenes::initial_gaussians;
use labelgs::scheduler::SchedulerOptions;
use labelgs::synth::{Preset, SynthOptions, dataset};
use labelgs::train::Trainer;
use labelgs::train::alignment::aligned;
use labelgs::train::state::TrainState;

/// Decisions nearer than this (relative) could flip within a difference.
const SAFE: f64 = 1e-4;

/// Number `k` of a preconditioner that mixes all six.
fn mixed(k: usize) -> f64 {
    if k.is_multiple_of(7) { 1.1 } else { 0.1 * (k % 5) as f64 - 0.15 }
}

fn of_photo(numbers: [[f64; 4]; 2]) -> PoseRows {
    std::array::from_fn(|row| match row {
        0 | 1 => numbers[row],
        _ => [mixed(3 * row - 6), mixed(3 * row - 5), mixed(3 * row - 4), 0.0],
    })
}

#[test]
fn the_mirror_has_the_gradient_of_the_loss() {
    let rules = Rules::default();
    let shape = Shape { gaussians: 9, width: 22, height: 18, sh_degree: 3, scales: (0.08, 0.5), ..Shape::default() };
    let numbers = [[0.1, -0.2, 0.15, 0.0], [0.05, 0.02, -0.08, 1.5]];
    let rows = of_photo(numbers);
    let safe = (300..700).map(|seed| scene(seed, &shape)).find_map(|scene| {
        let done = step(&rules, &corrected(&scene.camera, &rows), &scene.model(), &scene.target);
        (done.margin > SAFE).then_some((scene, done))
    });
    let (scene, done) = safe.expect("one seed in 400 keeps clear of all thresholds");
    let [v_turn, v_move] = backward(&rules, &scene.camera, &rows, (&scene.model(), &done.rows), 0.5);
    let analytic: Vec<f64> = v_turn.into_iter().chain(v_move).collect();
    let at: Vec<f64> = numbers.iter().flat_map(|row| row[..3].to_vec()).collect();
    let numeric = differences(&at, |p| {
        let rows = of_photo([[p[0], p[1], p[2], 0.0], [p[3], p[4], p[5], 1.5]]);
        let correction = |k: usize| (0..6).map(|i| mixed(6 * k + i) * p[i]).sum::<f64>();
        let prior = 0.25 * (0..6).map(|k| correction(k).powi(2)).sum::<f64>();
        step(&rules, &corrected(&scene.camera, &rows), &scene.model(), &scene.target).value + prior
    });
    agree("pose", &analytic, &numeric);
}

#[test]
fn a_correction_turns_around_the_centre_and_moves_it() {
    let camera = scene(1, &Shape::default()).camera;
    let moved = camera.corrected(DVec3::new(0.0, 0.2, 0.0), DVec3::new(1.0, 2.0, 3.0));
    assert!((moved.centre() - camera.centre() - DVec3::new(1.0, 2.0, 3.0)).length() < 1e-6);
    let angle = moved.axis().angle_between(camera.axis());
    assert!((angle - 2.0 * 0.1_f64.atan()).abs() < 1e-6, "{angle}");
    assert!((moved.rotation.determinant() - 1.0).abs() < 1e-6);
}

/// One pose of sixteen is off. Refinement brings it nearer, beside exposures, and a resumed training has the same bits.
#[test]
fn a_wrong_pose_is_found_and_goes_on_from_a_checkpoint() {
    let Some(turn) = device() else { return };
    let options = SynthOptions {
        preset: Preset::Simple,
        width: 96,
        height: 72,
        views: 16,
        points: 600,
        ..SynthOptions::default()
    };
    let mut scene = dataset(&options, 0);
    scene.train.iter_mut().for_each(|view| view.mask = None);
    let truth = scene.train[2].camera.clone();
    scene.train[2].camera = truth.corrected(DVec3::new(0.03, -0.02, 0.01), DVec3::ZERO);
    let start = initial_gaussians(&scene, 0, 400).expect("points");
    // Exposure and poses have rows of the same photo.
    let settings =
        TrainConfig { iterations: 700, exposure: ExposureMode::On, refine_poses: true, ..TrainConfig::default() };
    let mut straight =
        Trainer::new(turn.gpu(), settings, &scene, &start, SchedulerOptions::default()).expect("a trainer");
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("state");
    go_on(&mut straight, 620).write(&file).expect("a file");
    let expected = go_on(&mut straight, 700);
    // A turn and a move can stand for each other, so pixels decide: the mean distance of the points from their places.
    let off = |camera: &Camera, truth: &Camera| {
        let apart = |point: &Point| camera.sees(point.position)?.distance(truth.sees(point.position)?).into();
        let distances: Vec<f64> = scene.points.iter().filter_map(apart).collect();
        distances.iter().sum::<f64>() / distances.len() as f64
    };
    let poses = straight.poses().expect("poses");
    let (found, before) = (off(&poses[&scene.train[2].name], &truth), off(&scene.train[2].camera, &truth));
    assert!(found < 0.4 * before, "{found} of {before}");
    // The finished model finds the pose of another view, as it has it.
    let model = straight.model().expect("a model");
    let exact = &poses[&scene.train[5].name];
    let wrong = View { camera: exact.corrected(DVec3::new(0.03, -0.02, 0.01), DVec3::ZERO), ..scene.train[5].clone() };
    let (near, scheduler) = (straight.config().near, SchedulerOptions::default());
    let aligned = aligned(&turn.gpu(), &model, &[&wrong], (near, [0.0; 3]), scheduler).expect("a view");
    let (found, before) = (off(&aligned[0].camera, exact), off(&wrong.camera, exact));
    assert!(found < 0.2 * before, "{found} of {before}");
    let state = TrainState::read(&file).expect("a state");
    let mut resumed = Trainer::resume(turn.gpu(), &scene, state, SchedulerOptions::default()).expect("it goes on");
    assert_eq!(go_on(&mut resumed, 700).planes, expected.planes);
}

/// All poses of a ring are off. The trainer compares photos with each other, by the depths of a model that covers the
/// surfaces: hardly a step has been made, so that the gradient by the model cannot have found the poses.
#[test]
fn photos_compared_with_each_other_settle_all_poses() {
    let Some(turn) = device() else { return };
    let options = SynthOptions { width: 320, height: 240, views: 24, points: 40_000, ..SynthOptions::default() };
    let mut scene = dataset(&options, 0);
    let truth: Vec<Camera> = scene.train.iter().map(|view| view.camera.clone()).collect();
    for (k, view) in scene.train.iter_mut().enumerate() {
        let side = |by: usize| if (k / by).is_multiple_of(2) { 0.002 } else { -0.002 };
        view.camera = view.camera.corrected(DVec3::new(side(1), side(2), side(3)), DVec3::ZERO);
        view.mask = None;
    }
    let mut start = initial_gaussians(&scene, 0, 0).expect("points");
    start.opacities.fill(4.0);
    let settings = TrainConfig { iterations: 20, refine_poses: true, ..TrainConfig::default() };
    let mut trainer =
        Trainer::new(turn.gpu(), settings, &scene, &start, SchedulerOptions::default()).expect("a trainer");
    go_on(&mut trainer, 5);
    let found = trainer.poses().expect("poses");
    // Turns between neighbours, because a turn of all is open.
    let between = |a: &Camera, b: &Camera| b.rotation * a.rotation.transpose();
    let off = |of: &[Camera]| {
        let apart = |k: usize| {
            let (found, truth) = (between(&of[k], &of[k + 1]), between(&truth[k], &truth[k + 1]));
            DQuat::from_mat3(&(found * truth.transpose())).xyz().length()
        };
        (0..of.len() - 1).map(apart).sum::<f64>()
    };
    let before: Vec<Camera> = scene.train.iter().map(|view| view.camera.clone()).collect();
    let after: Vec<Camera> = scene.train.iter().map(|view| found[&view.name].clone()).collect();
    assert!(off(&after) < 0.1 * off(&before), "{} of {}", off(&after), off(&before));
}
