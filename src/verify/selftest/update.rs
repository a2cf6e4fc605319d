//! Compares the single-kernel update and late Gaussians with the reference.

use super::fixture::{Fixture, PARAMETER_PLANES};
use super::model::{rates_of, states};
use super::scenes::{Scene, Shape, scene};
use super::{Judge, judge};
use crate::error::Result;
use crate::reference::adam::{AdamState, Rates};
use crate::reference::model::ROW_FLOATS;
use crate::reference::{Row, Rules, adam, lazy};
use crate::scheduler::plan::Buf;
use crate::shaders::constants::{NO_SPLAT, STAT_NEAR};
use crate::train::strategy::Strategy as _;
use crate::train::strategy::budget::BudgetStrategy;
use crate::train::strategy::passes::FREE_SPACE_BIT;

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

/// A scene of many small Gaussians, in all directions from the camera.
pub fn many(seed: u64) -> Scene {
    let shape = Shape { gaussians: 6000, scales: (0.01, 0.4), sh_degree: 0, ..Shape::default() };
    let mut scene = scene(seed, &shape);
    scene.gaussians.means.iter_mut().for_each(|mean| *mean = mean.map(|value| 2.5 * value));
    scene
}

/// Runs three steps of a view that shows nothing, and one of the scene's camera that also marks fog. If it `drifts`,
/// Adam moves all Gaussians about as far as it can. Returns which Gaussians the last step lists, and which it marks.
pub fn drifted(fixture: &mut Fixture, drifts: bool, catches_up: bool) -> Result<[Vec<bool>; 2]> {
    let count = fixture.scene.gaussians.len();
    (fixture.config.sh_degree, fixture.fixed.extent, fixture.input.update) = (0, 120.0, true);
    fixture.view.near = 4.0;
    let sign = |row: usize, at: usize| if (row * 31 + at * 17) % 7 < 3 { 7.2e-3 } else { -7.2e-3 };
    let first = |row| Row::from_floats(&std::array::from_fn(|at| if drifts { sign(row, at) } else { 0.0 }));
    let second = Row::from_floats(&[1e-6; ROW_FLOATS]);
    fixture.put_moments(&(0..count).map(first).collect::<Vec<_>>(), &vec![second; count])?;
    fixture.engine.set_extension(BudgetStrategy.extension(), FREE_SPACE_BIT);
    let cx = fixture.scene.camera.cx;
    for step in 1..=4 {
        (fixture.input.step, fixture.input.updates) = (step, step);
        fixture.scene.camera.cx = if step < 4 { cx + 1e5 } else { cx };
        if step == 4 && catches_up {
            fixture.engine.catch_up()?;
        }
        fixture.train_with(if step < 4 { 0 } else { FREE_SPACE_BIT })?;
    }
    let splats = fixture.get::<u32>(Buf::SPLAT_FROM_GAUSSIAN, count)?;
    let stats = fixture.get::<[f32; 2]>(Buf::DENSIFY_STATS, count)?;
    let listed = splats.iter().map(|&splat| splat != NO_SPLAT).collect();
    Ok([listed, stats.iter().map(|&[_, views]| views >= STAT_NEAR).collect()])
}
