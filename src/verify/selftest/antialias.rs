//! A step of an antialiased model, and the pass that keeps its Gaussians smooth, against the mirrors.

use super::checks::bounds;
use super::compare::{Tolerance, Verdict, close, exact};
use super::fixture::{Fixture, GRADIENTS, PARAMETERS};
use super::judge;
use super::model::rig_of;
use super::scenes::{Scene, Shape, scene};
use crate::error::Result;
use crate::gpu::Gpu;
use crate::pass::KernelShape;
use crate::scheduler::plan::Buf;
use crate::train::strategy::Strategy as _;
use crate::train::strategy::budget::BudgetStrategy;
use crate::train::strategy::passes::SMOOTH;
use crate::verify::reference::project::{project_backward, project_forward};
use crate::verify::reference::smooth::smooth;
use crate::verify::reference::splat::{Splat, SplatGradient};
use crate::verify::reference::{Row, Rules};
use std::sync::Arc;

/// Gaussians from a twentieth of a pixel to some pixels.
pub fn fine(seed: u64) -> Scene {
    let shape = Shape { gaussians: 300, scales: (0.004, 0.4), opacities: (-2.0, 6.0), ..Shape::default() };
    let mut scene = scene(seed, &shape);
    scene.gaussians.antialiased = true;
    scene
}

/// A finished step of an antialiased model.
pub struct Antialiased {
    scene: Scene,
    splats: Vec<Splat>,
    v_splats: Vec<SplatGradient>,
    rows: Vec<Row>,
}

impl Antialiased {
    /// Runs the step.
    pub fn new(fixture: &mut Fixture) -> Result<Self> {
        fixture.train()?;
        let splats = fixture.splats()?;
        let v_splats = fixture.splat_gradients(&splats)?;
        let rows = fixture.rows(GRADIENTS, splats.len())?;
        Ok(Self { scene: fixture.scene.clone(), splats, v_splats, rows })
    }

    /// Compares splats and gradients with the reference under `rules`.
    pub fn verdict(&self, rules: &Rules, leeway: f64) -> Verdict {
        // A mutant of the switch turns it off.
        let rules = &Rules { antialiased: !rules.antialiased, ..rules.clone() };
        let (model, camera) = (self.scene.model(), &self.scene.camera);
        let projected = |s: &Splat| project_forward(rules, camera, &model, s.gaussian);
        let expected: Vec<Splat> = self.splats.iter().map(|s| projected(s).map_or(*s, |p| p.splat)).collect();
        // Determinants of needles are differences: opacities have larger errors than without.
        let of_splats = judge::splats(&self.splats, &expected, Tolerance { absolute: 4e-5 * leeway, relative: 0.0 });
        let is_sure =
            |place: &usize| projected(&self.splats[*place]).is_some_and(|p| p.clamp_margin.min(p.colour_margin) > 1e-5);
        let sure: Vec<usize> = (0..self.splats.len()).filter(is_sure).collect();
        let backward =
            |&at: &usize| project_backward(rules, camera, &model, self.splats[at].gaussian, &self.v_splats[at]);
        let expected: Vec<Row> = sure.iter().map(backward).collect();
        let found: Vec<Row> = sure.iter().map(|&at| self.rows[at]).collect();
        let bounds = bounds(4e-6 / 8.0 * leeway, 4e-6 / 8.0 * leeway);
        judge::all([of_splats, judge::rows(&found, &expected, self.scene.gaussians.sh_degree, bounds)])
    }
}

/// Least sizes after a step with the pass, beside those of a step without it.
pub struct Smoothed {
    scene: Scene,
    focal: f64,
    before: Vec<[f32; 4]>,
    /// Parameters after a step without the pass, and with it.
    rows: [Vec<Row>; 2],
    after: Vec<[f32; 4]>,
}

impl Smoothed {
    /// Runs the two steps. A third of the Gaussians has a limit below, a third one above that of the view; some of the
    /// Gaussians are outside of the view.
    pub fn new(rig: impl Fn() -> Result<Fixture>) -> Result<Self> {
        let step = |passes: u32| -> Result<_> {
            let mut fixture = rig()?;
            let count = fixture.scene.gaussians.len();
            let scales = fixture.scene.gaussians.scales.iter().enumerate();
            let before: Vec<[f32; 4]> = scales.map(|(row, &[x, y, z])| [x, y, z, [0.0, 0.01, 0.1][row % 3]]).collect();
            fixture.engine.raw_mut().upload(Buf::SCALES, 0, 0, &before)?;
            fixture.input.update = true;
            fixture.config.antialias = true;
            fixture.engine.set_extension(BudgetStrategy::default().extension(), SMOOTH);
            fixture.train_with(passes)?;
            let after = fixture.get::<[f32; 4]>(Buf::SCALES, count)?;
            Ok((fixture.rows(PARAMETERS, count)?, before, after, fixture.scene))
        };
        let (without, ..) = step(0)?;
        let (with, before, after, scene) = step(SMOOTH)?;
        let focal = scene.camera.fx.max(scene.camera.fy);
        Ok(Self { scene, focal, before, rows: [without, with], after })
    }

    /// Compares sizes and limits with the reference under `rules`, except for decisions too near to a threshold.
    pub fn verdict(&self, rules: &Rules, leeway: f64) -> Verdict {
        let camera = &self.scene.camera;
        let of = |(row, before): (&Row, &[f32; 4])| smooth(rules, camera, self.focal, row, f64::from(before[3]));
        let expected: Vec<(Row, f64, f64)> = self.rows[0].iter().zip(&self.before).map(of).collect();
        let sure: Vec<usize> = (0..expected.len()).filter(|&row| expected[row].2 > 1e-4).collect();
        let raised = sure.iter().filter(|&&row| expected[row].0 != self.rows[0][row]).count();
        let limited = sure.iter().filter(|&&row| expected[row].1 != f64::from(self.before[row][3])).count();
        let all = self.before.len();
        if sure.len() * 10 < all * 9 || raised * 5 < all || limited * 5 < all || limited == all {
            return Err(format!("of {} sure Gaussians, {raised} grow and {limited} have a new limit", sure.len()));
        }
        let found: Vec<f64> = sure.iter().flat_map(|&at| self.after[at].map(f64::from)).collect();
        let wanted = |&at: &usize| {
            let ([x, y, z], limit) = (expected[at].0.scale, expected[at].1);
            [x, y, z, limit]
        };
        let wanted: Vec<f64> = sure.iter().flat_map(wanted).collect();
        // A logarithm and a depth, some roundings each.
        let sizes = close(&found, &wanted, Tolerance { absolute: 1e-6 * leeway, relative: 3e-7 * leeway });
        let others = |rows: &[Row]| -> Vec<[u64; 3]> { rows.iter().map(|row| row.mean.map(f64::to_bits)).collect() };
        judge::all([sizes, exact(&others(&self.rows[1]), &others(&self.rows[0]))])
    }
}

/// A scene of which a half lies outside of the view.
pub fn around(seed: u64) -> Scene {
    let mut scene = fine(seed);
    scene.gaussians.means.iter_mut().step_by(2).for_each(|mean| *mean = mean.map(|value| 3.0 * value));
    scene
}

/// Checks the splats of an antialiased model, and their gradients.
pub(super) fn splats_of_a_step(rules: &Rules, gpu: &Arc<Gpu>, kernels: KernelShape, leeway: f64) -> Result<Verdict> {
    Ok(Antialiased::new(&mut rig_of(gpu, kernels, fine(93))?)?.verdict(rules, leeway))
}

/// Checks the least sizes of Gaussians.
pub(super) fn sizes_of_a_step(rules: &Rules, gpu: &Arc<Gpu>, kernels: KernelShape, leeway: f64) -> Result<Verdict> {
    Ok(Smoothed::new(|| rig_of(gpu, kernels, around(94)))?.verdict(rules, leeway))
}
