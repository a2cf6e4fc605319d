//! Compares a step of an antialiased model, and the pass that keeps Gaussians smooth, with the reference.

use super::Judge;
use super::checks::bounds;
use super::compare::{Tolerance, close, exact, pick, sure};
use super::fixture::{Fixture, GRADIENT_PLANES, PARAMETER_PLANES};
use super::judge;
use super::scenes::{Scene, Shape, scene};
use crate::error::Result;
use crate::reference::project::{project_backward, project_forward};
use crate::reference::smooth::smooth;
use crate::reference::splat::Splat;
use crate::reference::{Row, Rules};
use crate::scheduler::plan::Buf;
use crate::train::strategy::Strategy as _;
use crate::train::strategy::budget::BudgetStrategy;
use crate::train::strategy::passes::SMOOTH_BIT;

/// Gaussians from a twentieth of a pixel to several pixels.
pub fn fine(seed: u64) -> Scene {
    let shape = Shape { gaussians: 300, scales: (0.004, 0.4), opacities: (-2.0, 6.0), ..Shape::default() };
    let mut scene = scene(seed, &shape);
    scene.gaussians.antialiased = true;
    scene
}

/// A scene that is half outside of the view.
pub fn around(seed: u64) -> Scene {
    let mut scene = fine(seed);
    scene.gaussians.means.iter_mut().step_by(2).for_each(|mean| *mean = mean.map(|value| 3.0 * value));
    scene
}

/// Runs a step of an antialiased model, and compares splats and gradients.
pub fn step(fixture: &mut Fixture, leeway: f64) -> Result<Judge> {
    fixture.train()?;
    let splats = fixture.splats()?;
    let (v_splats, rows) = (fixture.splat_gradients(&splats)?, fixture.rows(GRADIENT_PLANES, splats.len())?);
    let (model, camera) = (fixture.model(), fixture.scene.camera.clone());
    // Determinants of thin splats are differences, so opacities have larger errors.
    let tolerance = Tolerance { absolute: 4e-5 * leeway, relative: 0.0 };
    Ok(Box::new(move |rules: &Rules| {
        // A mutation of the switch turns it off.
        let rules = &Rules { antialiased: !rules.antialiased, ..rules.clone() };
        let of_splats = judge::projection(rules, (&camera, &model), &splats, tolerance);
        let margin = |s: &Splat| {
            project_forward(rules, &camera, &model, s.gaussian).map_or(0.0, |p| p.clamp_margin.min(p.colour_margin))
        };
        let sure = sure(splats.iter().map(margin), 1e-5, 0.0)?;
        let backward = |&at: &usize| project_backward(rules, &camera, &model, splats[at].gaussian, &v_splats[at]);
        let expected: Vec<Row> = sure.iter().map(backward).collect();
        let bounds = bounds(4e-6 / 8.0 * leeway, 4e-6 / 8.0 * leeway);
        judge::combine([of_splats, judge::rows(&pick(&rows, &sure), &expected, model.sh_degree, bounds)])
    }))
}

/// Runs a step without the pass for smallest sizes, and one with it. A third of the Gaussians have a limit below the
/// view's, a third above; some are outside of the view. Decisions too close to a threshold are skipped.
pub fn sizes(rig: impl Fn() -> Result<Fixture>, leeway: f64) -> Result<Judge> {
    let step = |passes: u32| -> Result<_> {
        let mut fixture = rig()?;
        let scales = fixture.scene.gaussians.scales.iter().enumerate();
        let before: Vec<[f32; 4]> = scales.map(|(row, &[x, y, z])| [x, y, z, [0.0, 0.01, 0.1][row % 3]]).collect();
        fixture.engine.raw_mut().upload(Buf::SCALES, 0, 0, &before)?;
        fixture.input.update = true;
        fixture.config.antialias = true;
        fixture.engine.set_extension(BudgetStrategy.extension(), SMOOTH_BIT);
        fixture.train_with(passes)?;
        fixture.engine.catch_up()?;
        let after = fixture.get::<[f32; 4]>(Buf::SCALES, before.len())?;
        Ok((fixture.rows(PARAMETER_PLANES, before.len())?, before, after, fixture.scene.camera))
    };
    let (without, ..) = step(0)?;
    let (with, before, after, camera) = step(SMOOTH_BIT)?;
    // A logarithm and a depth, some roundings each.
    let tolerance = Tolerance { absolute: 1e-6 * leeway, relative: 3e-7 * leeway };
    Ok(Box::new(move |rules: &Rules| {
        let focal = camera.fx.max(camera.fy);
        let of = |(row, before): (&Row, &[f32; 4])| smooth(rules, &camera, focal, row, f64::from(before[3]));
        let expected: Vec<(Row, f64, f64)> = without.iter().zip(&before).map(of).collect();
        let sure = sure(expected.iter().map(|found| found.2), 1e-4, 0.9)?;
        let raised = sure.iter().filter(|&&row| expected[row].0 != without[row]).count();
        let limited = sure.iter().filter(|&&row| expected[row].1 != f64::from(before[row][3])).count();
        let all = before.len();
        if raised * 5 < all || limited * 5 < all || limited == all {
            return Err(format!(
                "of {} clearly decided Gaussians, {raised} grow and {limited} have a new limit",
                sure.len()
            ));
        }
        let found: Vec<f64> = sure.iter().flat_map(|&at| after[at].map(f64::from)).collect();
        let wanted = |&at: &usize| {
            let ([x, y, z], limit) = (expected[at].0.scale, expected[at].1);
            [x, y, z, limit]
        };
        let wanted: Vec<f64> = sure.iter().flat_map(wanted).collect();
        let others = |rows: &[Row]| -> Vec<[u64; 3]> { rows.iter().map(|row| row.mean.map(f64::to_bits)).collect() };
        judge::combine([close(&found, &wanted, tolerance), exact(&others(&with), &others(&without))])
    }))
}
