//! Compares the single-kernel update and late Gaussians with the reference.

use super::fixture::{Fixture, PARAMETER_PLANES};
use super::model::{rates_of, states};
use super::scenes::{Scene, Shape, scene};
use super::{Judge, judge};
use crate::error::Result;
use crate::reference::adam::{AdamState, Rates};
use crate::reference::{Row, Rules, adam, lazy};

const GAUSSIAN_COUNT: usize = 60;
/// Updates that all Gaussians miss.
const MISSED_UPDATES: u32 = 30;

/// A scene in which some Gaussians are frozen.
pub fn partly_frozen(seed: u64) -> Scene {
    Scene { frozen: 10, ..scene(seed, &Shape { gaussians: GAUSSIAN_COUNT, ..Shape::default() }) }
}

/// Runs a step in one kernel, `fused`, and its gradients in passes, `split`, from the same state.
pub fn step(fused: &mut Fixture, split: &mut Fixture) -> Result<Judge> {
    let mut done = Vec::new();
    fused.input.update = true;
    for step in 1..=3 {
        for fixture in [&mut *fused, &mut *split] {
            (fixture.input.step, fixture.input.updates) = (step, step);
        }
        let before = states(fused)?;
        let rows = fused.rows(PARAMETER_PLANES, GAUSSIAN_COUNT)?;
        split.put_rows(PARAMETER_PLANES, &rows)?;
        split.train()?;
        let gradients = split.gradient_rows()?;
        fused.train()?;
        fused.engine.catch_up()?;
        done.push((step, rates_of(fused), before, gradients, states(fused)?));
    }
    Ok(Box::new(move |rules: &Rules| {
        judge::combine(done.iter().map(|(step, rates, before, gradients, after)| {
            let mirror = |(state, gradient)| adam::adam(rules, rates, *step, state, gradient);
            let expected: Vec<AdamState> = before.iter().zip(gradients).map(mirror).collect();
            judge::updates(after, &expected, rates)
        }))
    }))
}

/// Runs steps of a view that shows nothing, after which all Gaussians catch up.
pub fn late(fixture: &mut Fixture) -> Result<Judge> {
    fixture.input.update = true;
    fixture.scene.camera.cx += 1e5;
    // Second moments of a few times the squares of the first ones.
    let sign = |at: usize| if at.is_multiple_of(2) { 1e-3 } else { -2e-4 };
    let moment = |row: usize, at: usize| (1.0 + (row * 7 + at * 3) as f64 % 5.0) * sign(at);
    let count = GAUSSIAN_COUNT - fixture.scene.frozen as usize;
    let rows = |of: &dyn Fn(f64) -> f64| -> Vec<Row> {
        let values = |row| std::array::from_fn(|at| f64::from(of(moment(row, at)) as f32));
        (0..count).map(|row| Row::from_floats(&values(row))).collect()
    };
    fixture.put_moments(&rows(&|m| m), &rows(&|m| 3.0 * m * m))?;
    let before = states(fixture)?;
    let mut missed = Vec::new();
    for step in 1..=MISSED_UPDATES {
        (fixture.input.step, fixture.input.updates) = (step, step);
        fixture.train()?;
        missed.push((step, rates_of(fixture)));
    }
    fixture.engine.catch_up()?;
    let after = states(fixture)?;
    Ok(Box::new(move |rules: &Rules| {
        let weights: Vec<Rates> = missed.iter().map(|(step, rates)| lazy::corrected(rules, rates, *step)).collect();
        let expected: Vec<AdamState> = before.iter().map(|state| lazy::caught_up(rules, &weights, state)).collect();
        let all = Rates(
            missed.iter().fold([0.0; 8], |sums, (_, rates)| std::array::from_fn(|group| sums[group] + rates.0[group])),
        );
        judge::updates(&after, &expected, &all)
    }))
}
