//! The optimiser, densification and the opacity reset.

use super::fixture::{Fixture, PARAMETER_PLANES, prove};
use crate::reference::Rules;
use crate::reference::densify::absolute_gradient2d;
use crate::reference::random::normal_draw;
use crate::reference::step::{Target, splats_of, step};
use crate::support::compare::{Tolerance, close};
use crate::support::device;
use crate::support::scenes::{Scene, Shape, population, scene, scene_of};
use labelgs::run::StrategyKind;
use labelgs::scheduler::plan::Buf;
use labelgs::train::input::step_input::SceneScale;
use labelgs::verify::selftest::model::{adam, densification, fog, large, reset};

/// Five steps, each from the previous state of the device.
#[test]
fn adam_of_every_attribute_equals_its_mirror() {
    let Some(turn) = device() else { return };
    let scene = Scene { frozen: 20, ..scene(101, &Shape { gaussians: 60, ..Shape::default() }) };
    let mut fixture = Fixture::new(turn, scene, true);
    let frozen = |fixture: &mut Fixture| fixture.rows(PARAMETER_PLANES, 60)[40..].to_vec();
    let stays = frozen(&mut fixture);
    fixture.fixed = SceneScale { extent: 4.0 };
    let judge = adam(&mut fixture, 5).expect("it runs");
    assert!(fixture.gradient_rows()[40..].iter().any(|row| row.mean != [0.0; 3]), "frozen Gaussians are seen");
    assert_eq!(frozen(&mut fixture), stays);
    prove("adam", &["adam_beta1", "adam_beta2", "adam_eps"], judge);
}

#[test]
fn draws_are_standard_normal() {
    let draws: Vec<f64> = (0..40_000).map(|i| normal_draw(17, i / 6, i % 6)).collect();
    let mean = |f: &dyn Fn(f64) -> f64| draws.iter().map(|&v| f(v)).sum::<f64>() / draws.len() as f64;
    assert!(
        mean(&|v| v).abs() < 0.015 && (mean(&|v| v * v) - 1.0).abs() < 0.03 && (mean(&|v| v.powi(4)) - 3.0).abs() < 0.2
    );
    let neighbours = draws.windows(2).map(|pair| pair[0] * pair[1]).sum::<f64>() / draws.len() as f64;
    assert!(neighbours.abs() < 0.015);
}

fn densify_case(step: u32, splits_long: bool, bearing: &[&str]) {
    let Some(turn) = device() else { return };
    let mut before = population(110 + u64::from(step), 500);
    // Rotations have any length.
    for (row, length) in before.model.rows.iter_mut().zip([1.0, 1e-15, 1e15, 1e-19, 1e19].into_iter().cycle()) {
        row.quat = row.quat.map(|value| f64::from((value * length) as f32));
    }
    let mut fixture = Fixture::new(turn, scene_of(&before), true);
    // 0.23 of (1e-6, 1e-7) seen. The logits of opacities after long splits reach -7.5, where numbers are 4.8e-7 apart;
    // 3.9e-7 seen.
    let tolerance = Tolerance { absolute: if splits_long { 1e-6 } else { 3.5e-7 }, relative: 3.5e-8 };
    let judge = densification(&mut fixture, before, (step, splits_long), tolerance).expect("it runs");
    prove(&format!("densify at {step}"), bearing, judge);
}

#[test]
fn early_densification_equals_its_mirror() {
    let bearing = ["densify_gradient", "percent_dense", "split_shrink", "prune_opacity", "prune_scale_after"];
    densify_case(600, false, &bearing);
}

#[test]
fn splits_along_the_longest_axis_equal_their_mirror() {
    let bearing = ["stat_near", "split_offset", "split_long", "split_others", "split_opacity"];
    densify_case(600, true, &bearing);
}

#[test]
fn absolute_gradients_of_tiles_equal_their_mirror() {
    let Some(turn) = device() else { return };
    let shape = Shape { gaussians: 60, width: 61, height: 45, ..Shape::default() };
    let mut fixture = Fixture::new(turn, scene(64, &shape), false);
    fixture.config.strategy = StrategyKind::Budget;
    fixture.train();
    let found = fixture.get::<[f32; 2]>(Buf::DENSIFY_STATS, 60);
    let (model, camera, target) = (fixture.model(), fixture.scene.camera.clone(), fixture.scene.target.clone());
    let rules = Rules::default();
    let out = step(&rules, &camera, &model, &Target { slots: Vec::new(), ..target.clone() });
    let tile = (fixture.engine.shape().tile_width as usize, fixture.engine.shape().tile_height as usize);
    let (splats, v_image) = (splats_of(&out.splats), out.photo.upstream().colours);
    let sums = absolute_gradient2d(&rules, &splats, ((61, 45), tile), target.background, &v_image);
    let sure: Vec<usize> = (0..splats.len()).filter(|&place| out.margins[splats[place].gaussian] > 2e-5).collect();
    assert!(sure.len() * 10 > splats.len() * 6 && splats.len() > 30, "{} of {}", sure.len(), splats.len());
    let pick = |of: &dyn Fn(usize) -> f64| sure.iter().map(|&place| of(place)).collect::<Vec<f64>>();
    let actual = pick(&|place| f64::from(found[splats[place].gaussian][0]));
    // As of the gradients of a whole step.
    let tolerance = Tolerance { absolute: 1.4e-6, relative: 6.7e-5 };
    close(&actual, &pick(&|place| sums[place]), tolerance).expect("the sums over tiles");
    let plain = pick(&|place| out.gradient2d[splats[place].gaussian]);
    assert!(close(&actual, &plain, tolerance).is_err(), "plain sums differ");
}

#[test]
fn marks_of_fog_equal_their_mirror() {
    let Some(turn) = device() else { return };
    let mut fixture = Fixture::new(turn, large(63), false);
    let judge = fog(&mut fixture).expect("it runs");
    prove("fog", &["free_size"], &judge);
    let narrow = Rules { jacobian_margin: 0.1, ..Rules::default() };
    assert!(judge(&narrow).is_err(), "the margin beyond the image matters");
}

#[test]
fn late_densification_removes_huge_gaussians() {
    densify_case(3100, false, &["densify_gradient", "percent_dense", "split_shrink", "prune_opacity", "prune_scale"]);
}

#[test]
fn opacity_reset_equals_its_mirror() {
    let Some(turn) = device() else { return };
    let before = population(120, 300);
    let mut fixture = Fixture::new(turn, scene_of(&before), true);
    let judge = reset(&mut fixture, before, 1.0).expect("it runs");
    prove("opacity reset", &["reset_opacity"], judge);
}
