//! Compares the passes of the strategy mcmc with the reference: relocation, random moves, regularisation.

use super::compare::{Tolerance, close, exact};
use super::fixture::{Fixture, PARAMETER_PLANES};
use super::model::{ChangedPopulation, GROW_ZONE, SEED, holding};
use super::scenes::{Shape, scene};
use super::{ERROR_FACTOR, Judge, Rig, judge};
use crate::engine::ListKey;
use crate::error::Result;
use crate::reference::densify::{Origin, Population};
use crate::reference::model::floats;
use crate::reference::random::{normal_draw, uniform_draw};
use crate::reference::relocate::{explored, regularised, relocate, weights};
use crate::reference::{Row, Rules};
use crate::scheduler::plan::Buf;
use crate::shaders::constants::NO_SPLAT;
use crate::shaders::structs::StepUniforms;
use crate::train::StrategyKind;
use crate::train::strategy::passes::EXPLORE_BIT;
use crate::train::strategy::{StepContext, make};

/// Relocates with this many draws; the fixture's model is the population. Opacities and scales of copies may differ.
pub fn relocation(fixture: &mut Fixture, before: Population, draws: u32, leeway: f64) -> Result<Judge> {
    fixture.engine.make_room_for_gaussians(before.model.rows.len() as u64 + u64::from(draws))?;
    let uniforms = holding(fixture, &before, 600, (false, Some(&GROW_ZONE)))?;
    let counted = fixture.engine.run(ListKey::RelocateCount, &uniforms)?.counters;
    let draws_per_weight = draws as f32 / counted.densified_count as f32;
    let uniforms = StepUniforms { draws, draws_per_weight, ..uniforms };
    let applied = fixture.engine.run(ListKey::RelocateApply, &uniforms)?.counters;
    let after = ChangedPopulation::read(fixture, applied.densified_count, before.frozen)?;
    // Values are logarithms, some after a division by the number of copies.
    let tolerance = Tolerance { absolute: 1e-6, relative: 1e-6 }.times(leeway);
    Ok(Box::new(move |rules: &Rules| {
        let rules = &Rules { grow_box: Some(GROW_ZONE), ..rules.clone() };
        let weights: u32 = weights(rules, &before).iter().map(|weight| weight.0).sum();
        exact(&[counted.densified_count], &[weights])?;
        let expected = relocate(rules, &before, draws, uniform_draw(SEED, NO_SPLAT, 0));
        let summary = after.compare(&expected, tolerance)?;
        let copies = expected.origins.iter().filter(|(_, origin)| *origin == Origin::Clone).count() as u32;
        let alive = expected.origins.len() as u32 - copies;
        let dead = before.model.rows.len() as u32 - alive;
        let applied = [applied.cloned_count, applied.pruned_count, applied.densified_count];
        exact(&applied, &[copies, dead, alive + copies])?;
        Ok(summary)
    }))
}

/// Chooses a strategy. Returns all passes that it has with the settings, for [`Fixture::train_with`].
pub fn set_strategy(fixture: &mut Fixture, kind: StrategyKind) -> u32 {
    fixture.config.strategy = kind;
    let strategy = make(kind);
    let all = strategy.passes(StepContext { step: 1, config: &fixture.config, extent: fixture.fixed.extent });
    fixture.engine.set_extension(strategy.extension(), all);
    all
}

/// Runs three steps of the strategy mcmc, each on a new fixture of `rig`: plain, with regularisation, and also with
/// random moves. Returns the verdicts of the moves and of the loss terms.
pub fn exploration(rig: impl Fn() -> Result<Fixture>, leeway: f64) -> Result<[Judge; 2]> {
    let (mut uniforms, mut start, mut visible) = (StepUniforms::default(), Vec::new(), Vec::new());
    // Gradients and parameters after each step.
    let mut steps = Vec::new();
    for without in [u32::MAX, EXPLORE_BIT, 0] {
        let mut fixture = rig()?;
        let count = fixture.scene.gaussians.len();
        // Large enough to stand out from the picture's gradients, and to move all except opaque Gaussians.
        (fixture.config.opacity_weight, fixture.config.scale_weight) = (Some(1.0), Some(1.0));
        fixture.config.position_lr_init = 2e-5;
        fixture.input.update = true;
        let all = set_strategy(&mut fixture, StrategyKind::Mcmc);
        fixture.train_with(all & !without)?;
        visible = fixture.get::<u32>(Buf::SPLAT_FROM_GAUSSIAN, count)?;
        (uniforms, start) = (fixture.uniforms(), fixture.model().rows);
        steps.push((fixture.gradient_rows()?, fixture.rows(PARAMETER_PLANES, count)?));
    }
    let gradients = [0, 1].map(|step: usize| floats(&steps[step].0));
    let [before, after] = [1, 2].map(|step: usize| steps[step].1.clone());
    // Moves are about 0.1. They depend on 100 times the opacity, and so on 100 times its rounding error.
    let tolerance = Tolerance { absolute: 2e-6, relative: 1e-6 }.times(leeway);
    let moves: Judge = Box::new(move |rules: &Rules| {
        let explore = |(row, from): (usize, &Row)| {
            let draw = [0, 1, 2].map(|axis| normal_draw(uniforms.seed, row as u32, axis));
            explored(rules, from, f64::from(uniforms.noise), draw)
        };
        let expected: Vec<Row> = before.iter().enumerate().map(explore).collect();
        close(&floats(&after), &floats(&expected), tolerance)
    });
    // The terms are the difference of two sums.
    let tolerance = Tolerance { absolute: 1e-7, relative: 1e-5 }.times(leeway);
    let terms: Judge = Box::new(move |_: &Rules| {
        let weights = [uniforms.opacity_weight, uniforms.scale_weight].map(f64::from);
        let term = |(row, &splat): (&Row, &u32)| {
            if splat == NO_SPLAT { Row::default() } else { regularised(row, weights).1 }
        };
        let expected: Vec<Row> = start.iter().zip(&visible).map(term).collect();
        let [plain, with] = &gradients;
        let found: Vec<f64> = with.iter().zip(plain).map(|(with, plain)| with - plain).collect();
        close(&found, &floats(&expected), tolerance)
    });
    Ok([moves, terms])
}

/// Checks random moves and regularisation in a step.
pub(super) fn random_moves(rig: &Rig) -> Result<Judge> {
    let scene = scene(65, &Shape { gaussians: 150, opacities: (-7.0, 3.0), ..Shape::default() });
    let [moves, terms] = exploration(|| rig.fixture(scene.clone()), ERROR_FACTOR)?;
    Ok(Box::new(move |rules: &Rules| judge::combine([moves(rules), terms(rules)])))
}
