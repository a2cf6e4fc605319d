//! Compares changes of the model with the reference: Adam, densification, opacity reset, fog marks, label lift.

use super::Judge;
use super::compare::{Tolerance, Verdict, close, exact, pick, sure};
use super::fixture::{Fixture, PARAMETER_PLANES};
use super::judge;
use super::scenes::{Scene, Shape, scene};
use crate::engine::ListKey;
use crate::error::Result;
use crate::pass::Update;
use crate::reference::adam::{AdamState, Rates};
use crate::reference::blend::blend_forward;
use crate::reference::densify::{DensifiedPopulation, Origin, Population, densify, is_near, mark, opacity_reset};
use crate::reference::lift::{Masks, centres_of, lift_resolve};
use crate::reference::model::floats;
use crate::reference::random::normal_draw;
use crate::reference::{Row, Rules, adam, lift};
use crate::scene::{Camera, Zone};
use crate::scheduler::plan::Buf;
use crate::shaders::structs::StepUniforms;
use crate::train::TrainConfig;
use crate::train::strategy::OPACITY_MIN;
use crate::train::strategy::Strategy as _;
use crate::train::strategy::adc::{CLONED_MAX, SCALE_MAX, prunes_large_at};
use crate::train::strategy::budget::BudgetStrategy;
use crate::train::strategy::passes::FREE_SPACE_BIT;
use glam::DVec3;

pub(super) const SEED: u32 = 0x1234_5678;
/// Box in which Gaussians of the strategies budget and mcmc grow, rotated in the world; it contains half of the
/// population.
pub(super) const GROW_ZONE: Zone = Zone {
    axes: [DVec3::new(0.6, 0.8, 0.0), DVec3::new(-0.8, 0.6, 0.0), DVec3::Z],
    low: DVec3::new(0.0, f64::NEG_INFINITY, -64.0),
    high: DVec3::new(64.0, f64::INFINITY, 64.0),
};

/// Runs steps with an update; each is compared separately, starting from the device's state before it.
pub fn adam(fixture: &mut Fixture, steps: u32) -> Result<Judge> {
    let mut done = Vec::new();
    fixture.input.update = true;
    for step in 1..=steps {
        (fixture.input.step, fixture.input.updates) = (step, step);
        let before = states(fixture)?;
        fixture.train()?;
        done.push((step, rates_of(fixture), before, fixture.gradient_rows()?, states(fixture)?));
    }
    fixture.input.update = false;
    Ok(Box::new(move |rules: &Rules| {
        judge::combine(done.iter().map(|(step, rates, before, gradients, after)| {
            let mirror = |(state, gradient)| adam::adam(rules, rates, *step, state, gradient);
            let expected: Vec<AdamState> = before.iter().zip(gradients).map(mirror).collect();
            judge::updates(after, &expected, rates)
        }))
    }))
}

/// Learning rates of the fixture's step.
pub(super) fn rates_of(fixture: &Fixture) -> Rates {
    let u = fixture.uniforms();
    let ([means, opacity], rest) = ([u.rate_means[0], u.rate_means[3]], u.rate_sh_rest);
    Rates([means, u.rate_quats, u.rate_scales, opacity, u.rate_sh0, rest, rest, rest].map(f64::from))
}

/// Parameters and moments of the trained Gaussians.
pub(super) fn states(fixture: &mut Fixture) -> Result<Vec<AdamState>> {
    let count = fixture.scene.gaussians.len() - fixture.scene.frozen as usize;
    let [rows, m, u] = fixture.planes(count, count)?;
    Ok((0..count).map(|i| AdamState { row: rows[i], m: m[i], u: u[i] }).collect())
}

/// Uploads a population with moments and statistics to a fixture. Returns the uniforms to change it at `step` in a
/// scene of extent 1.
pub(super) fn holding(
    fixture: &mut Fixture,
    before: &Population,
    step: u32,
    (splits_long, grow_box): (bool, Option<&Zone>),
) -> Result<StepUniforms> {
    let trained = before.model.rows.len() - before.frozen;
    fixture.put_moments(&before.m[..trained], &before.u[..trained])?;
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

/// A population after its number of Gaussians changed.
pub(super) struct ChangedPopulation {
    frozen: usize,
    /// Parameters, and both moments of the trained Gaussians.
    planes: [Vec<Row>; 3],
    labels: Vec<u32>,
    stats: Vec<f32>,
}

impl ChangedPopulation {
    /// Reads back `count` Gaussians.
    pub(super) fn read(fixture: &mut Fixture, count: u32, frozen: usize) -> Result<Self> {
        let (count, trained) = (count as usize, count as usize - frozen);
        let planes = fixture.planes(count, trained)?;
        let (labels, stats) = (fixture.get(Buf::LABELS, count)?, fixture.get(Buf::DENSIFY_STATS, 2 * trained)?);
        Ok(Self { frozen, planes, labels, stats })
    }

    /// Compares with the reference. Everything must be equal, except that parameters may differ by `tolerance`.
    pub(super) fn compare(&self, expected: &DensifiedPopulation, tolerance: Tolerance) -> Verdict {
        let nearest = expected.margins.iter().copied().fold(f64::INFINITY, f64::min);
        if nearest <= 1e-6 {
            return Err(format!("a decision of this seed is too close to a threshold: distance {nearest}"));
        }
        exact(&self.labels, &expected.model.labels)?;
        exact(&self.stats, &vec![0.0; self.stats.len()])?;
        let [rows, m, u] = &self.planes;
        let trained = expected.m.len() - self.frozen;
        exact(&floats(m), &floats(&expected.m[..trained]))?;
        exact(&floats(u), &floats(&expected.u[..trained]))?;
        close(&floats(rows), &floats(&expected.model.rows), tolerance)
    }
}

/// Counts and applies a densification at a step; the fixture's model is the population. Splits go along the longest
/// axis or to random positions. Positions and scales of children may differ from the reference's by `tolerance`.
pub fn densification(
    fixture: &mut Fixture,
    before: Population,
    (step, splits_long): (u32, bool),
    tolerance: Tolerance,
) -> Result<Judge> {
    let rows = before.model.rows.len();
    fixture.engine.make_room_for_gaussians(2 * rows as u64 + 1)?;
    let grow_box = splits_long.then_some(GROW_ZONE);
    let uniforms = holding(fixture, &before, step, (splits_long, grow_box.as_ref()))?;
    let counted = fixture.engine.run(ListKey::DensifyCount, &uniforms)?.counters;
    let marks = fixture.get::<u32>(Buf::CHILDREN_COUNTS, rows)?;
    let applied = fixture.engine.run(ListKey::DensifyApply, &uniforms)?.counters;
    let after = ChangedPopulation::read(fixture, counted.densified_count, before.frozen)?;
    Ok(Box::new(move |rules: &Rules| {
        let normal = |row: usize, child: u32, axis: usize| normal_draw(SEED, row as u32, 3 * child + axis as u32);
        let rules = &Rules { splits_long, grow_box, ..rules.clone() };
        let expected = densify(rules, &before, 1.0, step, normal);
        let summary = after.compare(&expected, tolerance)?;
        if counted != applied {
            return Err(format!("the count is {counted:?}, but the result is {applied:?}"));
        }
        exact(&marks, &mark(rules, &before, 1.0, step))?;
        let of = |origin: Origin| expected.origins.iter().filter(|(_, o)| *o == origin).count() as u32;
        exact(&[counted.cloned_count, counted.split_count], &[of(Origin::Clone), of(Origin::Child(1))])?;
        Ok(summary)
    }))
}

/// Resets opacities; the fixture's model is the population.
pub fn reset(fixture: &mut Fixture, before: Population, leeway: f64) -> Result<Judge> {
    let uniforms = holding(fixture, &before, 3000, (false, None))?;
    fixture.engine.run(ListKey::OpacityReset, &uniforms)?;
    let count = before.model.rows.len();
    let trained = count - before.frozen;
    let (after, labels) = (fixture.planes(count, trained)?, fixture.get::<u32>(Buf::LABELS, count)?);
    // The constant is the logit of 0.01, not of the nearest f32; the observed error is 8e-8.
    let tolerance = Tolerance { absolute: 1.2e-7 * leeway, relative: 0.0 };
    Ok(Box::new(move |rules: &Rules| {
        let mut expected = [before.model.rows.clone(), before.m[..trained].to_vec(), before.u[..trained].to_vec()];
        let [rows, m, u] = &mut expected;
        for ((row, m), u) in rows.iter_mut().zip(m).zip(u) {
            opacity_reset(rules, row, m, u);
        }
        exact(&labels, &before.model.labels)?;
        close(&floats(&after.concat()), &floats(&expected.concat()), tolerance)
    }))
}

/// Runs a training step with the paper's label lift; the scene has the labels from before. Exactly the expected labels
/// must change. If several Gaussians have nearly equal weights, any of them may win.
pub fn lift(fixture: &mut Fixture) -> Result<Judge> {
    let before = fixture.model().labels;
    fixture.train()?;
    let (after, splats) = (fixture.get::<u32>(Buf::LABELS, before.len())?, fixture.splats()?);
    let (sampled, target) = (fixture.slots(), fixture.scene.target.clone());
    let (size, gpf) = (fixture.size(), fixture.config.gpf);
    Ok(Box::new(move |rules: &Rules| {
        let image = blend_forward(rules, &splats, size, target.background);
        let masks = Masks { label_map: &target.label_map, sampled: &sampled, gpf };
        let votes = lift::lift(rules, &image, &centres_of(&splats, before.len()), &masks);
        let mut expected = before.clone();
        lift_resolve(&votes, &mut expected);
        let changed = expected.iter().zip(&before).filter(|(a, b)| a != b).count();
        if changed < 3 {
            return Err(format!("only {changed} labels change"));
        }
        let sure = sure(votes.margins, 1e-5, 0.9)?;
        exact(&pick(&after, &sure), &pick(&expected, &sure))
    }))
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

/// A scene in which some Gaussians are in front of the near plane of [`fog`], and some contain the camera. Its step
/// runs twice, because its pairs need more memory.
pub fn large(seed: u64) -> Scene {
    let mut scene = scene(seed, &Shape { gaussians: 3000, scales: (0.02, 5.0), ..Shape::default() });
    scene.gaussians.means.iter_mut().for_each(|mean| *mean = mean.map(|value| 2.5 * value));
    scene
}

/// Runs a step with the pass that marks Gaussians that fog its camera, or a camera on the way to another one. Decisions
/// too close to a threshold are skipped.
pub fn fog(fixture: &mut Fixture) -> Result<Judge> {
    /// Near plane, world units; about half of the Gaussians of [`large`] are in front of it.
    const NEAR: f32 = 4.0;
    /// Near plane of the other camera, world units.
    const OTHER_NEAR: f32 = 2.5;
    let camera = fixture.scene.camera.clone();
    let centre = camera.centre() + DVec3::new(1.5, 0.5, -0.5);
    let other = Camera { translation: -(camera.rotation * centre), ..camera.clone() };
    let centre = other.centre();
    fixture.view.near = NEAR;
    fixture.free_space = Some((other, OTHER_NEAR));
    fixture.input.update = true;
    fixture.engine.set_extension(BudgetStrategy.extension(), FREE_SPACE_BIT);
    let count = fixture.scene.gaussians.len();
    let before = fixture.rows(PARAMETER_PLANES, count)?;
    fixture.train_with(FREE_SPACE_BIT)?;
    let stats = fixture.get::<[f32; 2]>(Buf::DENSIFY_STATS, count)?;
    let is_late = fixture.engine.shape().update != Update::Split;
    let rows = if is_late { before } else { fixture.rows(PARAMETER_PLANES, count)? };
    Ok(Box::new(move |rules: &Rules| {
        let rules = Rules { near: f64::from(NEAR), ..rules.clone() };
        let decide = |row: &Row| is_near(&rules, &camera, Some((centre, f64::from(OTHER_NEAR))), row);
        let (expected, margins): (Vec<bool>, Vec<f64>) = rows.iter().map(decide).unzip();
        let marked = expected.iter().filter(|&&marked| marked).count();
        if marked * 10 < count || marked * 10 > count * 9 {
            return Err(format!("{marked} of {count} Gaussians are marked"));
        }
        let sure = sure(margins, 1e-4, 0.9)?;
        let found: Vec<bool> = stats.iter().map(|&[_, views]| views >= 1e9).collect();
        exact(&pick(&found, &sure), &pick(&expected, &sure))
    }))
}
