//! Checks the model changes other than Adam against the reference: densification, opacity reset, lift of labels.

use super::compare::{Tolerance, Verdict, close, exact};
use super::fixture::{Fixture, MOMENTS_1, MOMENTS_2, PARAMETERS, readable};
use super::scenes::{Scene, Shape, population, scene};
use crate::engine::ListKey;
use crate::error::Result;
use crate::gpu::Gpu;
use crate::pass::KernelShape;
use crate::scene::{Camera, Gaussians, Zone};
use crate::scheduler::plan::Buf;
use crate::shaders::structs::{Counters, StepUniforms};
use crate::train::TrainConfig;
use crate::train::strategy::OPACITY_MIN;
use crate::train::strategy::Strategy as _;
use crate::train::strategy::adc::{CLONED_MAX, SCALE_MAX, prunes_large_at};
use crate::train::strategy::budget::BudgetStrategy;
use crate::train::strategy::passes::FREE_SPACE;
use crate::verify::reference::blend::blend_forward;
use crate::verify::reference::densify::{Origin, Population, densify, is_near, mark, opacity_reset};
use crate::verify::reference::lift::{Masks, centres_of, lift, lift_resolve};
use crate::verify::reference::random::normal_draw;
use crate::verify::reference::splat::Splat;
use crate::verify::reference::step::Target;
use crate::verify::reference::{Row, Rules};
use glam::DVec3;
use std::sync::Arc;

pub(super) const SEED: u32 = 0x1234_5678;
/// Box in which Gaussians of the strategies budget and mcmc grow, turned against the world: a half of the populations.
pub(super) const GROW: Zone = Zone {
    axes: [DVec3::new(0.6, 0.8, 0.0), DVec3::new(-0.8, 0.6, 0.0), DVec3::Z],
    low: DVec3::new(0.0, f64::NEG_INFINITY, -64.0),
    high: DVec3::new(64.0, f64::INFINITY, 64.0),
};

/// Uploads a population with moments and statistics to a fixture; returns the uniforms that change it at `step` in a
/// scene of extent 1.
pub(super) fn holding(
    fixture: &mut Fixture,
    before: &Population,
    step: u32,
    (splits_long, grow_box): (bool, Option<&Zone>),
) -> Result<StepUniforms> {
    let trained = before.model.rows.len() - before.frozen;
    fixture.put_rows(MOMENTS_1, &before.m[..trained])?;
    fixture.put_rows(MOMENTS_2, &before.u[..trained])?;
    let stats = before.gradient_sum.iter().zip(&before.gradient_count).map(|(&s, &n)| [s as f32, n as f32]);
    let stats: Vec<[f32; 2]> = stats.take(trained).collect();
    fixture.engine.raw_mut().upload(Buf::DENSIFY_STATS, 0, 0, &stats)?;
    let (config, with_resets) = (&fixture.config, TrainConfig::paper());
    let uniforms = StepUniforms {
        densify_threshold: config.densify_grad_threshold,
        densify_scale: CLONED_MAX,
        prune_scale: SCALE_MAX,
        prune_opacity: OPACITY_MIN,
        prune_big: u32::from(prunes_large_at(&with_resets, step)),
        split_long: u32::from(splits_long),
        seed: SEED,
        ..fixture.uniforms()
    };
    Ok(grow_box.map_or(uniforms, |zone| fixture.engine.with_grow_box(uniforms, zone)))
}

/// A scene for a population; its picture does not matter.
pub fn scene_of(population: &Population) -> Scene {
    let template = scene(1, &Shape { gaussians: 1, ..Shape::default() });
    Scene { gaussians: gaussians(population), frozen: population.frozen as u32, ..template }
}

fn gaussians(population: &Population) -> Gaussians {
    let narrow = |v: f64| v as f32;
    let rows = &population.model.rows;
    Gaussians {
        means: rows.iter().map(|r| r.mean.map(narrow)).collect(),
        quats: rows.iter().map(|r| r.quat.map(narrow)).collect(),
        scales: rows.iter().map(|r| r.scale.map(narrow)).collect(),
        opacities: rows.iter().map(|r| narrow(r.opacity)).collect(),
        sh0: rows.iter().map(|r| r.sh[0].map(narrow)).collect(),
        sh_rest: rows.iter().flat_map(|r| r.sh[1..].iter().map(|c| c.map(narrow))).collect(),
        sh_degree: 3,
        labels: Some(population.model.labels.clone()),
        ..Gaussians::default()
    }
}

/// A finished densification.
pub struct Densified {
    step: u32,
    splits_long: bool,
    before: Population,
    counted: Counters,
    applied: Counters,
    marks: Vec<u32>,
    after: [Vec<Row>; 3],
    labels: Vec<u32>,
    stats: Vec<f32>,
}

impl Densified {
    /// Counts and applies a densification at `step`; the fixture's model is the population. Splits go along the longest
    /// axis or to random places.
    pub fn new(fixture: &mut Fixture, before: Population, step: u32, splits_long: bool) -> Result<Self> {
        let rows = before.model.rows.len();
        fixture.engine.make_room_for_gaussians(2 * rows as u64 + 1)?;
        let uniforms = holding(fixture, &before, step, (splits_long, splits_long.then_some(&GROW)))?;
        let counted = fixture.engine.run(ListKey::DensifyCount, &uniforms)?.counters;
        let marks = fixture.get::<u32>(Buf::CHILDREN_COUNTS, rows)?;
        let applied = fixture.engine.run(ListKey::DensifyApply, &uniforms)?.counters;
        let count = counted.densified_count as usize;
        let trained = count - before.frozen;
        let after =
            [fixture.rows(PARAMETERS, count)?, fixture.rows(MOMENTS_1, trained)?, fixture.rows(MOMENTS_2, trained)?];
        let (labels, stats) = (fixture.get(Buf::LABELS, count)?, fixture.get(Buf::DENSIFY_STATS, 2 * trained)?);
        Ok(Self { step, splits_long, before, counted, applied, marks, after, labels, stats })
    }

    /// Compares with the reference under `rules`. Everything must be copied exactly, except that positions and scales
    /// of children may differ by `tolerance`.
    pub fn verdict(&self, rules: &Rules, tolerance: Tolerance) -> Verdict {
        let normal = |row: usize, child: u32, axis: usize| normal_draw(SEED, row as u32, 3 * child + axis as u32);
        let rules =
            &Rules { splits_long: self.splits_long, grow_box: self.splits_long.then_some(GROW), ..rules.clone() };
        let expected = densify(rules, &self.before, 1.0, self.step, normal);
        let nearest = expected.margins.iter().copied().fold(f64::INFINITY, f64::min);
        if nearest <= 1e-6 {
            return Err(format!("a decision of this seed is too close to a threshold: distance {nearest}"));
        }
        if self.counted != self.applied {
            return Err(format!("the count is {:?}, but the result is {:?}", self.counted, self.applied));
        }
        exact(&self.marks, &mark(rules, &self.before, 1.0, self.step))?;
        exact(&self.labels, &expected.model.labels)?;
        exact(&self.stats, &vec![0.0; self.stats.len()])?;
        let of = |origin: Origin| expected.origins.iter().filter(|(_, o)| *o == origin).count() as u32;
        let counts = [self.counted.cloned_count, self.counted.split_count];
        exact(&counts, &[of(Origin::Clone), of(Origin::Child(1))])?;
        let floats = |rows: &[Row]| -> Vec<f64> { rows.iter().flat_map(Row::floats).collect() };
        let trained = expected.m.len() - self.before.frozen;
        exact(&floats(&self.after[1]), &floats(&expected.m[..trained]))?;
        exact(&floats(&self.after[2]), &floats(&expected.u[..trained]))?;
        close(&floats(&self.after[0]), &floats(&expected.model.rows), tolerance)
    }
}

/// A finished reset of opacities.
pub struct Reset {
    before: Population,
    after: Vec<f64>,
    labels: Vec<u32>,
}

impl Reset {
    /// Resets opacities; the fixture's model is the population.
    pub fn new(fixture: &mut Fixture, before: Population) -> Result<Self> {
        let uniforms = holding(fixture, &before, 3000, (false, None))?;
        fixture.engine.run(ListKey::OpacityReset, &uniforms)?;
        let count = before.model.rows.len();
        let trained = count - before.frozen;
        let planes =
            [fixture.rows(PARAMETERS, count)?, fixture.rows(MOMENTS_1, trained)?, fixture.rows(MOMENTS_2, trained)?];
        let after = planes.iter().flatten().flat_map(Row::floats).collect();
        Ok(Self { before, after, labels: fixture.get(Buf::LABELS, count)? })
    }

    /// Compares with the reference under `rules`.
    pub fn verdict(&self, rules: &Rules, tolerance: Tolerance) -> Verdict {
        let trained = self.before.model.rows.len() - self.before.frozen;
        let of_trained = |rows: &[Row]| rows[..trained].to_vec();
        let mut planes = [self.before.model.rows.clone(), of_trained(&self.before.m), of_trained(&self.before.u)];
        let [rows, m, u] = &mut planes;
        for ((row, m), u) in rows.iter_mut().zip(m).zip(u) {
            opacity_reset(rules, row, m, u);
        }
        exact(&self.labels, &self.before.model.labels)?;
        let expected: Vec<f64> = planes.iter().flatten().flat_map(Row::floats).collect();
        close(&self.after, &expected, tolerance)
    }
}

/// A finished step with the paper's lift of labels.
pub struct Lifted {
    before: Vec<u32>,
    after: Vec<u32>,
    splats: Vec<Splat>,
    sampled: Vec<u32>,
    target: Target,
    size: (usize, usize),
    gpf: bool,
}

impl Lifted {
    /// Runs a training step; the scene has the labels from before.
    pub fn new(fixture: &mut Fixture) -> Result<Self> {
        let before = fixture.model().labels;
        fixture.train()?;
        let (after, splats) = (fixture.get(Buf::LABELS, before.len())?, fixture.splats()?);
        let (sampled, target) = (fixture.slots(), fixture.scene.target.clone());
        Ok(Self { before, after, splats, sampled, target, size: fixture.size(), gpf: fixture.config.gpf })
    }

    /// Compares with the reference under `rules`: exactly the expected labels must change. If several Gaussians have
    /// nearly the same weight, any of them may win.
    pub fn verdict(&self, rules: &Rules) -> Verdict {
        let (before, target) = (&self.before, &self.target);
        let image = blend_forward(rules, &self.splats, self.size, target.background);
        let masks = Masks { label_map: &target.label_map, sampled: &self.sampled, gpf: self.gpf };
        let votes = lift(rules, &image, &centres_of(&self.splats, before.len()), &masks);
        let mut expected = before.clone();
        lift_resolve(&votes, &mut expected);
        let changed = expected.iter().zip(before).filter(|(a, b)| a != b).count();
        let sure: Vec<usize> = (0..before.len()).filter(|&i| votes.margins[i] > 1e-5).collect();
        if changed < 3 || sure.len() * 10 <= before.len() * 9 {
            return Err(format!(
                "{changed} labels change; {} of {} are away from all thresholds",
                sure.len(),
                before.len()
            ));
        }
        let pick = |of: &[u32]| sure.iter().map(|&i| of[i]).collect::<Vec<_>>();
        exact(&pick(&self.after), &pick(&expected))
    }
}

/// A scene of Gaussians that dominate pixels; masks are three columns, empty at the upper border.
pub fn dominant(seed: u64) -> Scene {
    let shape = Shape { scales: (0.1, 0.5), opacities: (1.0, 8.0), ..Shape::default() };
    let mut s = scene(seed, &Shape { gaussians: 50, width: 61, height: 45, ..shape });
    for (index, label) in s.target.label_map.iter_mut().enumerate() {
        *label = if index / 61 < 6 { 0 } else { (index % 61 * 3 / 61 + 1) as u32 };
    }
    s
}

/// A scene in which some Gaussians are before the near plane of [`Fog`], and some engulf the camera. Its step runs twice,
/// because its pairs need more room.
pub fn large(seed: u64) -> Scene {
    let mut scene = scene(seed, &Shape { gaussians: 3000, scales: (0.02, 5.0), ..Shape::default() });
    scene.gaussians.means.iter_mut().for_each(|mean| *mean = mean.map(|value| 2.5 * value));
    scene
}

/// A camera beside another one.
fn other_camera(camera: &Camera) -> Camera {
    let centre = camera.centre() + DVec3::new(1.5, 0.5, -0.5);
    Camera { translation: -(camera.rotation * centre), ..camera.clone() }
}

/// A finished step with the pass that marks Gaussians that fog its camera.
pub struct Fog {
    scene: Scene,
    rows: Vec<Row>,
    counts: Vec<f32>,
}

impl Fog {
    /// Near plane; about half of the Gaussians of [`large`] are before it, world units.
    const NEAR: f32 = 4.0;

    /// Near plane of the other camera, world units.
    const OTHER_NEAR: f32 = 2.5;

    /// Runs the step.
    pub fn new(fixture: &mut Fixture) -> Result<Self> {
        let count = fixture.scene.gaussians.len();
        fixture.view.near = Self::NEAR;
        fixture.free_space = Some((other_camera(&fixture.scene.camera), Self::OTHER_NEAR));
        fixture.input.update = true;
        fixture.engine.set_extension(BudgetStrategy::default().extension(), FREE_SPACE);
        fixture.train_with(FREE_SPACE)?;
        let stats = fixture.get::<[f32; 2]>(Buf::DENSIFY_STATS, count)?;
        let rows = fixture.rows(PARAMETERS, count)?;
        Ok(Self { scene: fixture.scene.clone(), rows, counts: stats.iter().map(|pair| pair[1]).collect() })
    }

    /// Compares with the reference under `rules`, except for decisions too near to a threshold.
    pub fn verdict(&self, rules: &Rules) -> Verdict {
        let rules = Rules { near: f64::from(Self::NEAR), ..rules.clone() };
        let other = (other_camera(&self.scene.camera).centre(), f64::from(Self::OTHER_NEAR));
        let decide = |row: &Row| is_near(&rules, &self.scene.camera, Some(other), row);
        let expected: Vec<(bool, f64)> = self.rows.iter().map(decide).collect();
        let sure: Vec<usize> = (0..expected.len()).filter(|&row| expected[row].1 > 1e-4).collect();
        let marked = expected.iter().filter(|(marked, _)| *marked).count();
        if sure.len() * 10 < expected.len() * 9 || marked * 10 < expected.len() || marked * 10 > expected.len() * 9 {
            return Err(format!("{} decisions are sure, {marked} Gaussians are marked", sure.len()));
        }
        let found: Vec<u32> = sure.iter().map(|&row| u32::from(f64::from(self.counts[row]) >= 1e9)).collect();
        exact(&found, &sure.iter().map(|&row| u32::from(expected[row].0)).collect::<Vec<_>>())
    }
}

pub(super) fn rig_of(gpu: &Arc<Gpu>, kernels: KernelShape, scene: Scene) -> Result<Fixture> {
    Fixture::new(Arc::clone(gpu), scene, true, kernels, readable())
}

/// Checks a densification of 500 Gaussians, some below and some above each threshold.
pub(super) fn densification(rules: &Rules, gpu: &Arc<Gpu>, kernels: KernelShape, leeway: f64) -> Result<Verdict> {
    densified(rules, gpu, kernels, (leeway, false))
}

/// Same as [`densification`], with splits along the longest axis.
pub(super) fn long_splits(rules: &Rules, gpu: &Arc<Gpu>, kernels: KernelShape, leeway: f64) -> Result<Verdict> {
    densified(rules, gpu, kernels, (leeway, true))
}

fn densified(
    rules: &Rules,
    gpu: &Arc<Gpu>,
    kernels: KernelShape,
    (leeway, splits_long): (f64, bool),
) -> Result<Verdict> {
    let before = population(710, 500);
    let mut fixture = rig_of(gpu, kernels, scene_of(&before))?;
    let tolerance = Tolerance { absolute: 3.5e-7 * leeway, relative: 3.5e-8 * leeway };
    Ok(Densified::new(&mut fixture, before, 600, splits_long)?.verdict(rules, tolerance))
}

/// Checks a reset of the opacities of 300 Gaussians.
pub(super) fn reset(rules: &Rules, gpu: &Arc<Gpu>, kernels: KernelShape, leeway: f64) -> Result<Verdict> {
    let before = population(120, 300);
    let mut fixture = rig_of(gpu, kernels, scene_of(&before))?;
    Ok(Reset::new(&mut fixture, before)?.verdict(rules, Tolerance { absolute: 1.2e-7 * leeway, relative: 0.0 }))
}

/// Checks the marks of Gaussians that fog the camera of a step.
pub(super) fn fog_of_a_step(rules: &Rules, gpu: &Arc<Gpu>, kernels: KernelShape, _: f64) -> Result<Verdict> {
    Ok(Fog::new(&mut rig_of(gpu, kernels, large(63))?)?.verdict(rules))
}

/// Checks the paper's lift of labels in one step.
pub(super) fn lift_of_a_step(rules: &Rules, gpu: &Arc<Gpu>, kernels: KernelShape, _: f64) -> Result<Verdict> {
    Ok(Lifted::new(&mut rig_of(gpu, kernels, dominant(131))?)?.verdict(rules))
}
