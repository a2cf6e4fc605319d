//! Votes for labels: the sums of a sweep against the mirror, for any number of columns and walks.

use super::fixture::{Fixture, PARAMETER_PLANES, VOTE_COLUMNS, prove};
use crate::reference::Rules;
use crate::reference::lift::{vote, vote_alone};
use crate::support::compare::{Tolerance, check, close};
use crate::support::device;
use crate::support::scenes::{Scene, Shape, scene};
use labelgs::engine::{Engine, EngineSize, LabelSize};
use labelgs::label::vote::ballot::{Sweep, Voter, sweep};
use labelgs::label::vote_engine;
use labelgs::scene::{LabelMap, Photo, View};
use labelgs::scheduler::SchedulerOptions;
use labelgs::train::strategy::weights::weights;
use std::collections::BTreeMap;

/// More labels than a walk counts and than the engine has columns for, many of them in one tile.
fn patches(seed: u64) -> Scene {
    let shape = Shape { scales: (0.1, 0.5), opacities: (-1.0, 5.0), ..Shape::default() };
    let mut s = scene(seed, &Shape { gaussians: 50, width: 45, height: 37, ..shape });
    for (index, label) in s.target.label_map.iter_mut().enumerate() {
        let (x, y) = (index % 45, index / 45);
        // Patches of 3 px: up to nine in a tile of 8 px; some without an object.
        *label = [0, 2, 3, 5, 7, 8, 11][(x / 3 + 4 * (y / 3)) % 7];
    }
    s
}

fn mask_of(s: &Scene) -> LabelMap {
    let (width, height) = (s.camera.width, s.camera.height);
    LabelMap { width, height, ids: s.target.label_map.iter().map(|&id| id as u16).collect() }
}

#[test]
fn vote_sums_equal_the_mirror() {
    let Some(turn) = device() else { return };
    let mut fixture = Fixture::new(turn, patches(141), true);
    fixture.render();
    let (splats, size, count) = (fixture.splats(), fixture.size(), fixture.scene.gaussians.len());
    let mask = mask_of(&fixture.scene);
    let photo: Photo = fixture.view.photo.clone();
    let camera = fixture.scene.camera.clone();
    let trust = BTreeMap::from([(3_u16, 0.25_f32), (8, 0.0)]);
    let voter =
        Voter { camera: &camera, mask: &mask.clone().into(), photo: Some(&photo.clone().into()), trust: Some(&trust) };
    // Three views that are the same: thrice the votes.
    let how = Sweep::new(fixture.config.near, 0);
    let ballot = sweep(&mut fixture.engine, &[voter, voter, voter], how).expect("votes");
    assert_eq!(ballot.labels, [0, 2, 3, 5, 7, 8, 11]);
    assert!(ballot.labels.len() > 2 * VOTE_COLUMNS as usize, "the sweep takes several rounds");
    let actual = ballot.weights();
    let columns: Vec<Option<usize>> = (mask.ids.iter().zip(&photo.rgba))
        .map(|(id, pixel)| ballot.labels.iter().position(|label| label == id).filter(|_| pixel[3] > 127))
        .collect();
    let weights: Vec<f64> =
        ballot.labels.iter().map(|label| 3.0 * trust.get(label).map_or(1.0, |&weight| f64::from(weight))).collect();
    assert!(columns.contains(&None), "some pixels have no say");
    prove("votes", &["alpha_min", "alpha_max"], |rules| {
        let expected = vote(rules, &splats, size, count, &columns, &weights);
        // Each tile's sum is rounded to 2^-16; a splat meets up to 30 tiles in each of three views.
        close(&actual, &expected, Tolerance { absolute: 90.0 * 0.5 / 65_536.0, relative: 1e-5 })
    });
}

#[test]
fn votes_alone_equal_the_mirror() {
    let Some(turn) = device() else { return };
    let mut fixture = Fixture::new(turn, patches(143), true);
    fixture.render();
    let (splats, size, count) = (fixture.splats(), fixture.size(), fixture.scene.gaussians.len());
    let (mask, camera) = (mask_of(&fixture.scene), fixture.scene.camera.clone());
    let voter = Voter { camera: &camera, mask: &mask.clone().into(), photo: None, trust: None };
    let how = Sweep { alone: true, ..Sweep::new(fixture.config.near, 0) };
    let ballot = sweep(&mut fixture.engine, &[voter], how).expect("votes");
    let column = |id: &u16| ballot.labels.iter().position(|label| label == id);
    let columns: Vec<Option<usize>> = mask.ids.iter().map(column).collect();
    let labels = ballot.labels.len();
    let actual = ballot.weights();
    let seen = vote(&Rules::default(), &splats, size, count, &columns, &vec![1.0; labels]);
    assert!(actual.iter().sum::<f64>() > 1.5 * seen.iter().sum::<f64>(), "most Gaussians hide each other");
    prove("votes alone", &["alpha_min", "alpha_max"], |rules| {
        let expected = vote_alone(rules, &splats, size, count, (&columns, labels));
        // Each tile's sum is rounded to 2^-16; a splat meets up to 30 tiles.
        close(&actual, &expected, Tolerance { absolute: 30.0 * 0.5 / 65_536.0, relative: 1e-5 })
    });
}

#[test]
fn weights_equal_the_mirror() {
    let Some(turn) = device() else { return };
    let mut fixture = Fixture::new(turn, patches(142), true);
    fixture.render();
    let (splats, size, count) = (fixture.splats(), fixture.size(), fixture.scene.gaussians.len());
    let (camera, near) = (fixture.scene.camera.clone(), fixture.config.near);
    // A step before, so that records with gradients of a photo are there, and a statistic.
    fixture.train();
    let found = weights(&mut fixture.engine, [(&camera, near); 3].into_iter()).expect("weights");
    let found: Vec<f64> = found.into_iter().map(f64::from).collect();
    assert!(found.iter().any(|&weight| weight > 30.0), "{found:?}");
    prove("weights", &["alpha_min", "alpha_max"], |rules| {
        let expected = vote(rules, &splats, size, count, &vec![Some(0); size.0 * size.1], &[3.0]);
        // Sums of three times 1665 pixels.
        close(&found, &expected, Tolerance { absolute: 1e-4, relative: 1e-5 })
    });
}

#[test]
fn pixels_near_a_contour_do_not_vote() {
    let Some(turn) = device() else { return };
    let mut fixture = Fixture::new(turn, patches(142), true);
    fixture.render();
    let (splats, size, count) = (fixture.splats(), fixture.size(), fixture.scene.gaussians.len());
    let mut mask = mask_of(&fixture.scene);
    // Two halves, so that something is left beside the contour.
    let width = mask.width as usize;
    mask.ids.iter_mut().enumerate().for_each(|(index, id)| *id = if index % width < 20 { 2 } else { 0 });
    let camera = fixture.scene.camera.clone();
    let voter = Voter { camera: &camera, mask: &mask.clone().into(), photo: None, trust: None };
    let how = Sweep::new(fixture.config.near, 2);
    let ballot = sweep(&mut fixture.engine, &[voter], how).expect("votes");
    let actual = ballot.weights();
    let column = |index: usize| match index % width {
        0..18 => Some(1),
        18..22 => None,
        _ => Some(0),
    };
    let columns: Vec<Option<usize>> = (0..mask.ids.len()).map(column).collect();
    let expected = vote(&Rules::default(), &splats, size, count, &columns, &[1.0, 1.0]);
    check("votes", close(&actual, &expected, Tolerance { absolute: 30.0 * 0.5 / 65_536.0, relative: 1e-5 }));
}

/// As many columns as labels, more than a word has bits: the same votes as in sweeps of three labels.
#[test]
fn one_sweep_of_many_labels_equals_many_sweeps() {
    let Some(turn) = device() else { return };
    let scene = patches(144);
    let mut mask = mask_of(&scene);
    let width = mask.width as usize;
    let patch = |index: usize| (index % width / 3 + 15 * (index / width / 3)) as u16;
    mask.ids.iter_mut().enumerate().for_each(|(index, id)| *id = 7 * patch(index));
    let view = View { name: "0.png".into(), camera: scene.camera.clone(), photo: None, mask: None };
    let how = Sweep::new(0.2, 0);
    let [few, many] = [3, 400].map(|columns| {
        let mut engine = vote_engine(turn.gpu(), &scene.gaussians, &[&view], columns).expect("the engine starts");
        sweep(&mut engine, &[Voter::for_view(&view, &mask.clone().into())], how).expect("votes")
    });
    assert!(many.labels.len() > 150, "{} labels", many.labels.len());
    assert!((0..many.len()).any(|row| many.row(row).len() > 64), "a Gaussian meets many labels");
    assert!(few == many, "the votes differ");
}

/// Votes of a training come and go with a sweep, and give room to the gradients and the scratch memory of its steps.
#[test]
fn a_training_has_memory_for_votes_only_while_it_counts_them() {
    let Some(turn) = device() else { return };
    let gpu = turn.gpu();
    let mut fixture = Fixture::new(turn, patches(145), true);
    let state = |fixture: &mut Fixture| fixture.rows(PARAMETER_PLANES, 50);
    fixture.train();
    let (before, capacity) = (state(&mut fixture), *fixture.engine.capacity());
    let votes = |fixture: &Fixture| fixture.engine.raw().memory().iter().any(|(name, _)| name.starts_with("votes_"));
    assert!(!votes(&fixture), "none before");
    let (mask, camera) = (mask_of(&fixture.scene).into(), fixture.scene.camera.clone());
    let voter = Voter { camera: &camera, mask: &mask, photo: None, trust: None };
    let how = Sweep::new(fixture.config.near, 0);
    let ballot = sweep(&mut fixture.engine, &[voter], how).expect("votes");
    assert!((0..ballot.len()).any(|row| !ballot.row(row).is_empty()) && !votes(&fixture), "none after");
    assert_eq!((state(&mut fixture), *fixture.engine.capacity()), (before, capacity));
    fixture.train();

    // The larger of both counts: votes of 8 bytes for each of 100 labels, or what a step has besides them.
    let labels = |vote_columns| Some(LabelSize { max_label: 100, layers: 0, vote_columns });
    let total = |gaussians: u64, columns: u32| {
        let size = EngineSize::new(gaussians, (64, 48)).for_training().with_labels(labels(columns));
        Engine::predict(&gpu, &size, SchedulerOptions::default()).expect("it fits").total
    };
    let (with, without) = (total(100_000, 100), total(100_000, 0));
    // Gradients alone are 60 floats a Gaussian.
    assert!(with > without && with - without < (8 * 100 - 4 * 60) * 100_000, "{with} {without}");
    assert!(total(100_000, 10) - without < 100_000, "few votes fit where the scratch memory of a step was");
}
