//! The optimiser, densification and the opacity reset.

use super::fixture::{Fixture, MOMENTS_1, MOMENTS_2, PARAMETERS, prove};
use crate::reference::adam::{Optimised, Rates, adam};
use crate::reference::random::normal_draw;
use crate::support::compare::Tolerance;
use crate::support::device;
use crate::support::scenes::{Shape, population, scene};
use labelgs::internals::train::step_input::SceneScale;
use labelgs::internals::verify::selftest::judge;
use labelgs::internals::verify::selftest::model::{Densified, Reset, scene_of};

fn states(fixture: &mut Fixture) -> Vec<Optimised> {
    let count = fixture.scene.gaussians.len();
    let (rows, m, u) =
        (fixture.rows(PARAMETERS, count), fixture.rows(MOMENTS_1, count), fixture.rows(MOMENTS_2, count));
    (0..count).map(|i| Optimised { row: rows[i], m: m[i], u: u[i] }).collect()
}

/// Five steps, each from the previous state of the device.
#[test]
fn adam_of_every_attribute_equals_its_mirror() {
    let Some(turn) = device() else { return };
    let mut fixture = Fixture::new(turn, scene(101, &Shape { gaussians: 60, ..Shape::default() }), true);
    fixture.fixed = SceneScale { extent: 4.0 };
    fixture.input.update = true;
    let mut steps = Vec::new();
    for step in 1..=5 {
        (fixture.input.step, fixture.input.updates) = (step, step);
        let before = states(&mut fixture);
        fixture.train();
        steps.push((step, fixture.uniforms(), before, fixture.gradient_rows(), states(&mut fixture)));
    }
    prove("adam", &["adam_beta1", "adam_beta2", "adam_eps"], |rules| {
        judge::all(steps.iter().map(|(step, u, before, gradients, after)| {
            let [means, opacity] = [u.rate_means[0], u.rate_means[3]];
            let rest = u.rate_sh_rest;
            let rates =
                Rates([means, u.rate_quats, u.rate_scales, opacity, u.rate_sh0, rest, rest, rest].map(f64::from));
            let mirror = |(state, gradient)| adam(rules, &rates, *step, state, gradient);
            let expected: Vec<Optimised> = before.iter().zip(gradients).map(mirror).collect();
            judge::updates(after, &expected, &rates)
        }))
    });
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

fn densify_case(step: u32, bearing: &[&str]) {
    let Some(turn) = device() else { return };
    let mut before = population(110 + u64::from(step), 500);
    // Rotations have any length.
    for (row, length) in before.model.rows.iter_mut().zip([1.0, 1e-15, 1e15, 1e-19, 1e19].into_iter().cycle()) {
        row.quat = row.quat.map(|value| f64::from((value * length) as f32));
    }
    let mut fixture = Fixture::new(turn, scene_of(&before), true);
    let ran = Densified::new(&mut fixture, before, step).expect("it runs");
    prove(&format!("densify at {step}"), bearing, |rules| {
        // 0.23 of (1e-6, 1e-7) seen.
        ran.verdict(rules, Tolerance { absolute: 3.5e-7, relative: 3.5e-8 })
    });
}

#[test]
fn early_densification_equals_its_mirror() {
    let bearing = ["densify_gradient", "percent_dense", "split_shrink", "prune_opacity", "prune_scale_after"];
    densify_case(600, &bearing);
}

#[test]
fn late_densification_removes_huge_gaussians() {
    densify_case(3100, &["densify_gradient", "percent_dense", "split_shrink", "prune_opacity", "prune_scale"]);
}

#[test]
fn opacity_reset_equals_its_mirror() {
    let Some(turn) = device() else { return };
    let before = population(120, 300);
    let mut fixture = Fixture::new(turn, scene_of(&before), true);
    let ran = Reset::new(&mut fixture, before).expect("it runs");
    prove("opacity reset", &["reset_opacity"], |rules| {
        // The constant is the logit of 0.01, not of the nearest f32; 8e-8 seen.
        ran.verdict(rules, Tolerance { absolute: 1.2e-7, relative: 0.0 })
    });
}
