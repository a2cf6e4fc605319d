//! Runs every mode on a scene: once for its errors, then round robin for its times.

use super::bed::{Sample, TestBed};
use super::errors::{Errors, compare};
use super::mirror::{View, without_cut_offs};
use super::modes::{Mode, Replacements};
use super::scenes::{self, Kind, Plan};
use crate::measure::median;
use labelgs::Result;
use labelgs::gpu::Gpu;
use labelgs::pass::Stage;
use labelgs::reference::Rules;
use serde::Serialize;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Stages that no mode touches.
const UNTOUCHED_STAGES: [Stage; 4] = [Stage::LOSS, Stage::OPTIMISE, Stage::LABELS, Stage::REPORT];
/// Decisions closer to their threshold than this may flip in f32 (tests/pass/step.rs).
const MARGIN_MIN: f64 = 2e-5;

/// A mode on a scene.
#[derive(Clone, Debug, Serialize)]
pub struct ModeResult {
    /// Name of the mode.
    pub name: &'static str,
    /// Time of the stages that modes change, relative to the default in the same round; median over the rounds.
    pub relative_median: f64,
    /// CPU time of the step, relative to the default in the same round; median over the rounds.
    pub relative_cpu: Option<f64>,
    /// Median time of each stage, ms.
    pub stages: BTreeMap<&'static str, f64>,
    /// Number of sorted (splat, tile) pairs.
    pub instances: u32,
    /// Errors relative to the float64 step with the engine's rules.
    pub against_rules: Errors,
    /// Errors relative to the float64 step without cut-offs.
    pub against_no_cut_offs: Errors,
}

/// A scene.
#[derive(Clone, Debug, Serialize)]
pub struct SceneResult {
    /// Name.
    pub name: &'static str,
    /// Description.
    pub about: &'static str,
    /// Gaussians.
    pub gaussians: usize,
    /// Image size, px.
    pub size: (u32, u32),
    /// Timed rounds.
    pub rounds: usize,
    /// Splats of the view.
    pub splats: u32,
    /// (splat, pixel) pairs walked by the forward pass.
    pub pairs: u64,
    /// Load average over a minute, after the scene.
    pub load: Option<f64>,
    /// The modes, the default first.
    pub modes: Vec<ModeResult>,
    /// Errors of the default relative to the float64 step where no decision is close: rounding alone.
    pub rounding: Errors,
}

/// Measures a scene.
pub fn scene(gpu: &Arc<Gpu>, plan: &Plan, modes: &[(Mode, Replacements)]) -> Result<SceneResult> {
    let mut scene = scenes::build(plan);
    let (rules, open) = (Rules::default(), without_cut_offs());
    let picture = View::new(&rules, &scene).picture().0;
    scenes::set_photo(&mut scene, &picture);
    let (by_rules, by_open) = (View::new(&rules, &scene).step(), View::new(&open, &scene).step());
    let mut bed = TestBed::new(gpu, scene, modes)?;
    // Run all lists once, so that buffers grow and drivers compile.
    for list in 0..modes.len() {
        bed.run(list)?;
    }
    let mut errors = Vec::new();
    let mut rounding = Errors::default();
    for list in 0..modes.len() {
        bed.run(list)?;
        let outcome = bed.outcome()?;
        errors.push((compare(&outcome, &by_rules, 0.0), compare(&outcome, &by_open, 0.0)));
        if list == 0 {
            rounding = compare(&outcome, &by_rules, MARGIN_MIN);
            bed.check_default(&outcome)?;
        }
    }
    let samples = time(&mut bed, modes.len(), plan.rounds)?;
    let results = modes.iter().zip(&samples).zip(errors);
    let results = results.map(|(((mode, _), own), errors)| result(mode, own, &samples[0], errors));
    let counters = samples[0][0].counters;
    Ok(SceneResult {
        name: plan.name,
        about: plan.about,
        gaussians: plan.gaussians,
        size: plan.size,
        rounds: plan.rounds,
        splats: counters.visible_count,
        pairs: counters.walked_splats() * u64::from(bed.tile_pixels()),
        load: crate::measure::load(),
        modes: results.collect(),
        rounding,
    })
}

fn result(
    mode: &Mode,
    own: &[Sample],
    of_default: &[Sample],
    (against_rules, against_no_cut_offs): (Errors, Errors),
) -> ModeResult {
    let touched = |sample: &Sample| {
        let touched = sample.stages.iter().filter(|(stage, _)| !UNTOUCHED_STAGES.contains(stage));
        Some(touched.map(|(_, ms)| ms).sum())
    };
    let relative_median = ratio(own, of_default, touched).unwrap_or(f64::NAN);
    let relative_cpu = ratio(own, of_default, |sample| sample.cpu);
    let ms = |stage: &Stage| median(own.iter().map(|sample| sample.stages[stage]));
    ModeResult {
        name: mode.name,
        relative_median,
        relative_cpu,
        stages: own[0].stages.keys().map(|stage| (stage.name, ms(stage))).collect(),
        instances: own[0].counters.instance_count,
        against_rules,
        against_no_cut_offs,
    }
}

/// Returns samples of every list by round. Each round starts at another list, and every other round runs backwards, so
/// that no mode always follows the same one.
fn time(bed: &mut TestBed<'_>, count: usize, rounds: usize) -> Result<Vec<Vec<Sample>>> {
    let mut samples: Vec<Vec<Sample>> = vec![Vec::new(); count];
    for round in 0..rounds {
        for place in 0..count {
            let forward = if round % 2 == 0 { place } else { count - 1 - place };
            let list = (forward + 7 * round) % count;
            samples[list].push(bed.run(list)?);
        }
    }
    Ok(samples)
}

/// Returns the median of the rounds' ratios.
fn ratio(own: &[Sample], of_default: &[Sample], ms: impl Fn(&Sample) -> Option<f64>) -> Option<f64> {
    let ratios = own.iter().zip(of_default).map(|(a, b)| Some(ms(a)? / ms(b)?));
    ratios.collect::<Option<Vec<f64>>>().map(median)
}

/// Returns what is wrong with the default mode, if anything. Without close decisions, errors come from rounding, and in
/// large scenes from a few pairs of equal f32 depth. Bounds are three times the errors on lavapipe.
pub fn fault_of_default(scene: &SceneResult, kind: Kind) -> Option<String> {
    let errors = &scene.rounding;
    let (colour, gradient) = match kind {
        // Exponents of needles are small differences of large products.
        Kind::Needles => (1.2e-4, 2.6e-4),
        // Of 180,000 splats, a few are sorted differently.
        Kind::Trained => (1e-5, 2.4e-4),
        _ => (5e-6, 3e-5),
    };
    // If nearly every Gaussian is close to a decision, compare all of them.
    let all = &scene.modes.first()?.against_rules;
    let gradients = if errors.rows * 10 < scene.gaussians { &all.gradients } else { &errors.gradients };
    let found = (errors.colours.p999, gradients.worst.rms);
    let good = found.0 <= colour && found.1 <= gradient;
    (!good).then(|| {
        format!(
            "{}: the default mode is off by {:.2e} in colours and {:.2e} in gradients, {colour:.0e} and {gradient:.0e} \
             are allowed",
            scene.name, found.0, found.1
        )
    })
}
