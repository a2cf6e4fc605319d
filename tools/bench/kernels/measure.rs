//! Runs every mode on a scene: once for its errors, then round robin for its times.

use super::bed::{Bed, Sample};
use super::errors::{Errors, compare};
use super::mirror::{View, without_cut_offs};
use super::modes::{Mode, Replacements};
use super::passes::{PassRow, rows_of};
use super::scenes::{self, Kind, Plan};
use crate::measure::{Spread, spread};
use labelgs::gpu::Gpu;
use labelgs::pass::Stage;
use labelgs::shaders::structs::Counters;
use labelgs::verify::reference::Rules;
use labelgs::{Error, Result};
use serde::Serialize;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Stages that no mode touches.
const UNTOUCHED: [Stage; 4] = [Stage::Loss, Stage::Optimise, Stage::Labels, Stage::Report];
/// Decisions nearer than this to their threshold may go the other way in f32 (tests/pass/step.rs).
const MARGIN: f64 = 2e-5;

/// A mode on a scene.
#[derive(Clone, Debug, Serialize)]
pub struct ModeResult {
    /// Name of the mode.
    pub name: &'static str,
    /// What charts show as time: on a processor its time, `relative_cpu`, which other programs disturb least; on a
    /// graphics card `relative_median`.
    pub relative_time: f64,
    /// Time of the stages that modes touch by that of the default in the same round, median over the rounds.
    pub relative_median: f64,
    /// The same by the least times.
    pub relative_least: f64,
    /// Processor time of the step by that of the default in the same round, median over the rounds.
    pub relative_cpu: Option<f64>,
    /// ms of the stages that modes touch, all but loss, optimiser and report: median, and the sum of the least times of
    /// the passes.
    pub touched: Spread,
    /// ms of each stage.
    pub stages: BTreeMap<&'static str, Spread>,
    /// Processor time of a step without optimiser, ms.
    pub cpu: Option<Spread>,
    /// (splat, tile) pairs that were sorted.
    pub instances: u32,
    /// Against the float64 step with the engine's rules.
    pub against_rules: Option<Errors>,
    /// Against the float64 step without stop and cut.
    pub against_no_cut_offs: Option<Errors>,
}

/// A scene.
#[derive(Clone, Debug, Serialize)]
pub struct SceneResult {
    /// Name.
    pub name: &'static str,
    /// What it is.
    pub about: &'static str,
    /// Gaussians.
    pub gaussians: usize,
    /// Image, px.
    pub size: (u32, u32),
    /// Timed rounds.
    pub rounds: usize,
    /// Splats of the view.
    pub splats: u32,
    /// (splat, tile) pairs.
    pub instances: u32,
    /// (splat, pixel) pairs that the forward pass walked.
    pub pairs: u64,
    /// Processes that waited for a processor, on the average of a minute, after the scene.
    pub load: Option<f64>,
    /// The modes, the default first.
    pub modes: Vec<ModeResult>,
    /// The passes of the default step, the optimiser among them.
    pub passes: Vec<PassRow>,
    /// The default against the float64 step, where no decision is near: rounding alone.
    pub rounding: Option<Errors>,
}

/// Measures a scene.
pub fn scene(gpu: &Arc<Gpu>, plan: &Plan, modes: &[(Mode, Replacements)]) -> Result<SceneResult> {
    let mut scene = scenes::build(plan);
    let (rules, open) = (Rules::default(), without_cut_offs());
    let mut mirrors = None;
    if plan.compared {
        let picture = View::new(&rules, &scene).picture().0;
        scenes::set_photo(&mut scene, &picture);
        mirrors = Some((View::new(&rules, &scene).step(), View::new(&open, &scene).step()));
    }
    let mut bed = Bed::new(gpu, scene, modes)?;
    let mut errors: Vec<Option<(Errors, Errors)>> = vec![None; modes.len()];
    let mut rounding = None;
    // All lists once: buffers grow, drivers compile.
    for list in 0..=bed.full_step() {
        bed.run(list)?;
    }
    if let Some((by_rules, by_open)) = &mirrors {
        for (list, errors) in errors.iter_mut().enumerate() {
            bed.run(list)?;
            let outcome = bed.outcome()?;
            *errors = Some((compare(&outcome, by_rules, 0.0), compare(&outcome, by_open, 0.0)));
            if list == 0 {
                rounding = Some(compare(&outcome, by_rules, MARGIN));
                bed.check_default(&outcome)?;
            }
        }
    }
    drop(mirrors);
    let mut samples: Vec<Vec<Sample>> = vec![Vec::new(); bed.full_step() + 1];
    for round in 0..plan.rounds {
        // Every round begins elsewhere and every other one goes backwards, so that no mode always follows the same one.
        let count = samples.len();
        for place in 0..count {
            let forward = if round % 2 == 0 { place } else { count - 1 - place };
            let list = (forward + 7 * round) % count;
            samples[list].push(bed.run(list)?);
        }
    }
    let counters = counters(&samples[0])?;
    let tile = bed.tile_pixels();
    let default = Times::of(&samples[0]);
    let results = modes.iter().zip(&samples).zip(errors);
    let results = results.map(|(((mode, _), samples), errors)| {
        let (against_rules, against_no_cut_offs) = errors.unzip();
        let times = Times::of(samples);
        let relative_median = ratio(&times.touched, &default.touched);
        let relative_cpu = times.cpu.as_ref().zip(default.cpu.as_ref()).map(|(own, of_default)| ratio(own, of_default));
        Ok(ModeResult {
            name: mode.name,
            relative_time: relative_cpu.filter(|_| gpu.is_cpu()).unwrap_or(relative_median),
            relative_median,
            relative_least: times.least / default.least,
            relative_cpu,
            touched: Spread { min: times.least, ..spread(times.touched) },
            stages: stage_times(samples),
            cpu: times.cpu.map(spread),
            instances: self::counters(samples)?.instance_count,
            against_rules,
            against_no_cut_offs,
        })
    });
    let modes = results.collect::<Result<Vec<_>>>()?;
    let passes = rows_of(&samples[bed.full_step()], plan, &counters, tile);
    Ok(SceneResult {
        name: plan.name,
        about: plan.about,
        gaussians: plan.gaussians,
        size: plan.size,
        rounds: plan.rounds,
        splats: counters.visible_count,
        instances: counters.instance_count,
        pairs: counters.walked_splats() * u64::from(tile),
        load: crate::measure::load(),
        modes,
        passes,
        rounding,
    })
}

/// Times of a mode by round, ms.
struct Times {
    /// Of the stages that modes touch.
    touched: Vec<f64>,
    /// Sum over their passes of the least time that each took in any round.
    least: f64,
    /// Processor time of the step.
    cpu: Option<Vec<f64>>,
}

impl Times {
    fn of(samples: &[Sample]) -> Self {
        let is_touched = |stage: Stage| !UNTOUCHED.contains(&stage);
        let mut least: Vec<u64> = Vec::new();
        for sample in samples {
            let times = sample.items.iter().filter(|(stage, ..)| is_touched(*stage)).map(|(.., ns)| *ns);
            for (place, ns) in times.enumerate() {
                match least.get_mut(place) {
                    Some(so_far) => *so_far = (*so_far).min(ns),
                    None => least.push(ns),
                }
            }
        }
        Self {
            touched: samples.iter().map(|sample| sample.ms(is_touched)).collect(),
            least: least.iter().sum::<u64>() as f64 * 1e-6,
            cpu: samples.iter().map(|sample| sample.cpu.map(|cpu| cpu.as_secs_f64() * 1e3)).collect(),
        }
    }
}

/// Median of the ratios of each round.
fn ratio(own: &[f64], of_default: &[f64]) -> f64 {
    spread(own.iter().zip(of_default).map(|(a, b)| a / b).collect()).median
}

fn counters(samples: &[Sample]) -> Result<Counters> {
    samples.last().map(|sample| sample.counters).ok_or_else(|| Error::usage("--rounds", "at least 1 is needed"))
}

fn stage_times(samples: &[Sample]) -> BTreeMap<&'static str, Spread> {
    let has = |stage: Stage| samples.iter().any(|sample| sample.items.iter().any(|(found, ..)| *found == stage));
    let of = |stage: Stage| spread(samples.iter().map(|sample| sample.ms(|found| found == stage)).collect());
    Stage::ALL.into_iter().filter(|stage| has(*stage)).map(|stage| (stage.name(), of(stage))).collect()
}

/// What is wrong with the default mode, if anything. Where no decision is near, all that is left is rounding, and in
/// large scenes a few pairs whose depths are the same f32; the bounds are three times what lavapipe shows.
pub fn fault_of_default(scene: &SceneResult, kind: Kind) -> Option<String> {
    let errors = scene.rounding.as_ref()?;
    let (colour, gradient) = match kind {
        // Exponents of needles are small differences of large products.
        Kind::Needles => (1.2e-4, 2.6e-4),
        // Of 180,000 splats a few are sorted the other way.
        Kind::Trained => (1e-5, 2.4e-4),
        _ => (5e-6, 3e-5),
    };
    // Where nearly every Gaussian is near some decision, all of them are looked at.
    let all = scene.modes.first()?.against_rules.as_ref()?;
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
