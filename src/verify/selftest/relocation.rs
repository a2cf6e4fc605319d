//! Checks the passes of the strategy mcmc against the reference: relocation, random moves, regularisation.

use super::compare::{Tolerance, Verdict, close, exact};
use super::fixture::{Fixture, MOMENTS_1, MOMENTS_2, PARAMETERS};
use super::judge;
use super::model::{GROW, SEED, holding, rig_of, scene_of};
use super::scenes::{Shape, population, scene};
use crate::engine::ListKey;
use crate::error::Result;
use crate::gpu::Gpu;
use crate::pass::KernelShape;
use crate::scheduler::plan::Buf;
use crate::shaders::constants::NO_SPLAT;
use crate::shaders::structs::{Counters, StepUniforms};
use crate::train::StrategyKind;
use crate::train::strategy::passes::EXPLORE;
use crate::train::strategy::{At, of};
use crate::verify::reference::densify::{Origin, Population};
use crate::verify::reference::random::{normal_draw, uniform_draw};
use crate::verify::reference::relocate::{explored, regularised, relocate, weights};
use crate::verify::reference::{Row, Rules};
use std::sync::Arc;

/// Opacities and scales of copies are logarithms, some after a division by the number of copies.
pub const COPIES: Tolerance = Tolerance { absolute: 1e-6, relative: 1e-6 };
/// The terms of the loss are the difference of two sums.
pub const TERMS: Tolerance = Tolerance { absolute: 1e-7, relative: 1e-5 };
/// Moves are about 0.1. They depend on 100 times the opacity, and so on 100 times its rounding error.
pub const MOVES: Tolerance = Tolerance { absolute: 2e-6, relative: 1e-6 };

fn floats(rows: &[Row]) -> Vec<f64> {
    rows.iter().flat_map(Row::floats).collect()
}

/// A finished relocation.
pub struct Relocated {
    before: Population,
    draws: u32,
    counted: Counters,
    applied: Counters,
    after: [Vec<Row>; 3],
    labels: Vec<u32>,
    stats: Vec<f32>,
}

impl Relocated {
    /// Relocates with this many draws; the fixture's model is the population.
    pub fn new(fixture: &mut Fixture, before: Population, draws: u32) -> Result<Self> {
        fixture.engine.make_room_for_gaussians(before.model.rows.len() as u64 + u64::from(draws))?;
        let uniforms = holding(fixture, &before, 600, (false, Some(&GROW)))?;
        let counted = fixture.engine.run(ListKey::RelocateCount, &uniforms)?.counters;
        let draws_per_weight = draws as f32 / counted.densified_count as f32;
        let uniforms = StepUniforms { draws, draws_per_weight, ..uniforms };
        let applied = fixture.engine.run(ListKey::RelocateApply, &uniforms)?.counters;
        let count = applied.densified_count as usize;
        let trained = count - before.frozen;
        let after =
            [fixture.rows(PARAMETERS, count)?, fixture.rows(MOMENTS_1, trained)?, fixture.rows(MOMENTS_2, trained)?];
        let (labels, stats) = (fixture.get(Buf::LABELS, count)?, fixture.get(Buf::DENSIFY_STATS, 2 * trained)?);
        Ok(Self { before, draws, counted, applied, after, labels, stats })
    }

    /// Compares with the reference under `rules`. Everything must be copied exactly, except that opacities and scales of
    /// copies may differ by `tolerance`.
    pub fn verdict(&self, rules: &Rules, tolerance: Tolerance) -> Verdict {
        let rules = &Rules { grow_box: Some(GROW), ..rules.clone() };
        let weights: u32 = weights(rules, &self.before).iter().map(|weight| weight.0).sum();
        exact(&[self.counted.densified_count], &[weights])?;
        let expected = relocate(rules, &self.before, self.draws, uniform_draw(SEED, NO_SPLAT, 0));
        let nearest = expected.margins.iter().copied().fold(f64::INFINITY, f64::min);
        if nearest <= 1e-6 {
            return Err(format!("a decision of this seed is too close to a threshold: distance {nearest}"));
        }
        exact(&self.labels, &expected.model.labels)?;
        exact(&self.stats, &vec![0.0; self.stats.len()])?;
        let copies = expected.origins.iter().filter(|(_, origin)| *origin == Origin::Clone).count() as u32;
        let alive = expected.origins.len() as u32 - copies;
        let dead = self.before.model.rows.len() as u32 - alive;
        let applied = [self.applied.cloned_count, self.applied.pruned_count, self.applied.densified_count];
        exact(&applied, &[copies, dead, alive + copies])?;
        let trained = expected.m.len() - self.before.frozen;
        exact(&floats(&self.after[1]), &floats(&expected.m[..trained]))?;
        exact(&floats(&self.after[2]), &floats(&expected.u[..trained]))?;
        close(&floats(&self.after[0]), &floats(&expected.model.rows), tolerance)
    }
}

/// A step of the strategy mcmc from one state: as any step, with regularisation, and with random moves too.
pub struct Explored {
    uniforms: StepUniforms,
    visible: Vec<bool>,
    /// Gradients and parameters after each step.
    steps: Vec<[Vec<Row>; 2]>,
}

impl Explored {
    /// Runs the three steps, each on a new fixture of `rig`.
    pub fn new(rig: impl Fn() -> Result<Fixture>) -> Result<Self> {
        let (mut uniforms, mut visible, mut steps) = (StepUniforms::default(), Vec::new(), Vec::new());
        for without in [u32::MAX, EXPLORE, 0] {
            let mut fixture = rig()?;
            let count = fixture.scene.gaussians.len();
            fixture.config.strategy = StrategyKind::Mcmc;
            // Enough to stand out from the gradients of the picture, and to move all but opaque Gaussians.
            (fixture.config.opacity_weight, fixture.config.scale_weight) = (Some(1.0), Some(1.0));
            fixture.config.position_lr_init = 2e-5;
            fixture.input.update = true;
            let strategy = of(StrategyKind::Mcmc);
            let all = strategy.passes(At { step: 1, config: &fixture.config, extent: fixture.fixed.extent });
            fixture.engine.set_extension(strategy.extension(), all);
            fixture.train_with(all & !without)?;
            let splats = fixture.get::<u32>(Buf::SPLAT_FROM_GAUSSIAN, count)?;
            visible = splats.into_iter().map(|splat| splat != NO_SPLAT).collect();
            uniforms = fixture.uniforms();
            steps.push([fixture.gradient_rows()?, fixture.rows(PARAMETERS, count)?]);
        }
        Ok(Self { uniforms, visible, steps })
    }

    /// Compares the change of the gradients with the reference.
    pub fn regularised(&self, start: &[Row], tolerance: Tolerance) -> Verdict {
        let weights = [self.uniforms.opacity_weight, self.uniforms.scale_weight].map(f64::from);
        let expected = start
            .iter()
            .zip(&self.visible)
            .map(|(row, &visible)| if visible { regularised(row, weights).1 } else { Row::default() });
        let difference = |(a, b): (f64, f64)| a - b;
        let [plain, with] = [0, 1].map(|step: usize| floats(&self.steps[step][0]));
        let found: Vec<f64> = with.into_iter().zip(plain).map(difference).collect();
        close(&found, &floats(&expected.collect::<Vec<_>>()), tolerance)
    }

    /// Compares the moves with the reference under `rules`.
    pub fn moved(&self, rules: &Rules, tolerance: Tolerance) -> Verdict {
        let noise = f64::from(self.uniforms.noise);
        let explore = |(row, from): (usize, &Row)| {
            let draw = [0, 1, 2].map(|axis| normal_draw(self.uniforms.seed, row as u32, axis));
            explored(rules, from, noise, draw)
        };
        let expected: Vec<Row> = self.steps[1][1].iter().enumerate().map(explore).collect();
        close(&floats(&self.steps[2][1]), &floats(&expected), tolerance)
    }
}

/// Checks a relocation of 200 Gaussians, some of them dead.
pub(super) fn relocation(rules: &Rules, gpu: &Arc<Gpu>, kernels: KernelShape, leeway: f64) -> Result<Verdict> {
    let before = population(711, 200);
    let mut fixture = rig_of(gpu, kernels, scene_of(&before))?;
    Ok(Relocated::new(&mut fixture, before, 300)?.verdict(rules, COPIES.times(leeway)))
}

/// Checks random moves and regularisation in a step.
pub(super) fn exploration(rules: &Rules, gpu: &Arc<Gpu>, kernels: KernelShape, leeway: f64) -> Result<Verdict> {
    let scene = scene(65, &Shape { gaussians: 150, opacities: (-7.0, 3.0), ..Shape::default() });
    let start = scene.model().rows;
    let ran = Explored::new(|| rig_of(gpu, kernels, scene.clone()))?;
    let found = [ran.regularised(&start, TERMS.times(leeway)), ran.moved(rules, MOVES.times(leeway))];
    Ok(judge::all(found))
}
