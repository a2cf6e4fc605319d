//! Strategies other than the default: what they may change, and that a checkpoint records them.

use crate::invariants::training::{budgeted, config, small};
use crate::support::device;
use crate::support::device::Turn;
use labelgs::Result;
use labelgs::pass::{Builder, Extension, Hook};
use labelgs::run::{DensifyCounts, LabelRule, StrategyKind, TrainConfig};
use labelgs::scene::{Dataset, Gaussians};
use labelgs::scenes::initial_gaussians;
use labelgs::scheduler::SchedulerOptions;
use labelgs::scheduler::plan::Buf;
use labelgs::shaders::structs::StepUniforms;
use labelgs::train::setup::TrainerOptions;
use labelgs::train::state::TrainState;
use labelgs::train::strategy::population::Population;
use labelgs::train::strategy::{StepContext, Strategy};
use labelgs::train::{Loss, Objective, Parameter, Trainer};
use serde_json::{Value, json};
use std::sync::Arc;

/// Never grows. Drops faint Gaussians every seven steps and does not train colours. In every second step it resets the
/// momentum of positions and skips Gaussians that the view does not show.
#[derive(Debug, Default)]
struct Thinning {
    rounds: u32,
}

#[derive(Debug)]
struct Forgetful;

impl Extension for Forgetful {
    fn extend(&self, passes: u32, hook: Hook, b: &mut Builder) {
        if passes == 1 && hook == Hook::Updated {
            b.list.fill(Buf::M_MEANS, 0);
        }
    }

    fn updates_unseen(&self, _passes: u32) -> bool {
        false
    }
}

impl Strategy for Thinning {
    fn name(&self) -> &'static str {
        "thinning"
    }

    fn acts_after(&self, at: StepContext) -> bool {
        at.step.is_multiple_of(7)
    }

    fn act(&mut self, _at: StepContext, population: &mut Population) -> Result<()> {
        self.rounds += 1;
        let prune_opacity = 0.02 * self.rounds as f32 + 0.05;
        let uniforms = StepUniforms { densify_threshold: 0.0, prune_opacity, ..population.uniforms() };
        let what = population.densify(uniforms, u64::MAX)?;
        assert_eq!((what.cloned, what.split), (0, 0));
        Ok(())
    }

    fn uniforms(&self, _at: StepContext, to: &mut StepUniforms) {
        to.rate_sh0 = 0.0;
    }

    fn extension(&self) -> Arc<dyn Extension> {
        Arc::new(Forgetful)
    }

    fn passes(&self, at: StepContext) -> u32 {
        u32::from(at.step.is_multiple_of(2))
    }

    fn keep(&self) -> Value {
        json!(self.rounds)
    }

    fn restore(&mut self, kept: &Value) -> Result<(), String> {
        self.rounds = kept.as_u64().ok_or("no number of rounds")? as u32;
        Ok(())
    }
}

fn options() -> TrainerOptions {
    TrainerOptions { strategy: Some(Box::new(Thinning::default())), ..TrainerOptions::default() }
}

fn settings() -> TrainConfig {
    TrainConfig { iterations: 30, ..config(LabelRule::Votes) }
}

/// Every third Gaussian is faint.
fn start() -> Gaussians {
    let mut model = initial_gaussians(&small(), 0, 100).expect("points");
    model.opacities.iter_mut().enumerate().for_each(|(row, logit)| *logit = if row % 3 == 0 { -3.5 } else { -0.5 });
    model
}

fn fresh(turn: &Turn, options: impl Into<TrainerOptions>) -> Trainer {
    Trainer::new(turn.gpu(), settings(), &small(), &start(), options).expect("a trainer")
}

fn go_on(trainer: &mut Trainer, until: u32) -> TrainState {
    while trainer.steps_done() < until {
        trainer.step().expect("a step");
    }
    trainer.state().expect("a state")
}

fn plane<'a>(state: &'a TrainState, name: &str) -> Option<&'a [u32]> {
    state.planes.iter().find(|plane| plane.name == name).map(|plane| &plane.data[..])
}

#[test]
fn a_strategy_controls_the_population() {
    let Some(turn) = device() else { return };
    let mut trainer = fresh(&turn, options());
    let first = go_on(&mut trainer, 5);
    assert!(plane(&first, "m_means").expect("moments").iter().any(|&word| word != 0), "an odd step keeps momentum");
    assert!(plane(&first, "densify_stats").is_none(), "it keeps no statistics");
    let colours: Vec<[f32; 3]> = trainer.model().expect("a model").sh0;
    assert_eq!(colours, start().sh0);
    let second = go_on(&mut trainer, 6);
    assert!(plane(&second, "m_means").expect("moments").iter().all(|&word| word == 0), "an even one forgets it");
    let counts: Vec<u32> = [7, 14, 21, 30].map(|until| go_on(&mut trainer, until).gaussians).to_vec();
    assert!(counts[0] < second.gaussians && counts.is_sorted_by(|a, b| a >= b), "{} {counts:?}", second.gaussians);
    let grown = go_on(&mut fresh(&turn, SchedulerOptions::default()), 30).gaussians;
    assert!(grown > second.gaussians, "by default the same settings grow: {grown}");
}

#[test]
fn a_strategy_goes_on_from_a_checkpoint_of_its_own() {
    let Some(turn) = device() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("state");
    let mut trainer = fresh(&turn, options());
    go_on(&mut trainer, 16).write(&file).expect("a file");
    let expected = go_on(&mut trainer, 30);
    let read = || TrainState::read(&file).expect("a state");
    let mut resumed = Trainer::resume(turn.gpu(), &small(), read(), options()).expect("it goes on");
    let found = go_on(&mut resumed, 30);
    assert_eq!((found.gaussians, &found.strategy), (expected.gaussians, &expected.strategy));
    assert_eq!(found.strategy.value, json!(4), "rounds after 30 steps");
    assert_eq!(found.planes, expected.planes);
    let refused = Trainer::resume(turn.gpu(), &small(), read(), SchedulerOptions::default());
    let error = refused.err().expect("another strategy").to_string();
    assert!(error.contains("thinning") && error.contains("adc"), "{error}");
}

/// An unseen Gaussian has gradient 0. Its momentum still moves it, unless the strategy skips unseen Gaussians.
#[test]
fn unseen_gaussians_move_or_rest() {
    let Some(turn) = device() else { return };
    for (options, rests) in [(options(), true), (TrainerOptions::default(), false)] {
        let mut model = start();
        model.opacities[7] = -20.0;
        let mut trainer = Trainer::new(turn.gpu(), settings(), &small(), &model, options).expect("a trainer");
        trainer.step().expect("a step");
        trainer.drain().expect("its report");
        // What it missed comes before other moments.
        trainer.engine_mut().catch_up().expect("it catches up");
        let before = trainer.model().expect("a model").means[7];
        trainer.engine_mut().raw_mut().upload(Buf::M_MEANS, 0, 7, &[[1.0_f32, 0.0, 0.0, 0.0]]).expect("upload");
        trainer.engine_mut().raw_mut().upload(Buf::U_MEANS, 0, 7, &[[1.0_f32; 4]]).expect("upload");
        trainer.step().expect("a step");
        let after = trainer.model().expect("a model").means[7];
        assert_eq!(before == after, rests, "{before:?} {after:?}");
    }
}

#[test]
fn gaussians_grow_in_the_box_only() {
    let Some(turn) = device() else { return };
    let grown = |strategy: StrategyKind, grow_box: Option<[f64; 6]>| {
        let config = TrainConfig {
            iterations: 60,
            densify_from: Some(5),
            densify_interval: Some(10),
            densify_grad_threshold: 1e-7,
            budget: 4 * start().len() as u64,
            prune_share: 0.0,
            strategy,
            grow_box,
            ..config(LabelRule::Votes)
        };
        let mut trainer = Trainer::new(turn.gpu(), config, &small(), &start(), TrainerOptions::default()).expect("one");
        go_on(&mut trainer, 60);
        trainer.model().expect("a model").len()
    };
    let before = start().len();
    for strategy in [StrategyKind::Budget, StrategyKind::Mcmc, StrategyKind::Adc] {
        let (all, around) = (grown(strategy, None), grown(strategy, Some([-99.0, -99.0, -99.0, 99.0, 99.0, 99.0])));
        assert!(all > before && all == around, "{strategy:?}: {before} became {all} and {around}");
        let none = grown(strategy, Some([50.0, 50.0, 50.0, 51.0, 51.0, 51.0]));
        assert!(none <= before, "{strategy:?}: {before} became {none}, and the box is empty");
    }
}

/// Soon after growth: with masks, Gaussians with little weight make room for parts of those across contours.
#[test]
fn gaussians_across_contours_split_in_place_of_others() {
    let Some(turn) = device() else { return };
    let exchanged = |contour_share: f64, scene: &Dataset| {
        let config = TrainConfig { contour_share, ..budgeted() };
        let mut trainer = Trainer::new(turn.gpu(), config, scene, &start(), SchedulerOptions::default()).expect("one");
        let before = go_on(&mut trainer, 24).gaussians;
        trainer.take_densified();
        let after = go_on(&mut trainer, 25).gaussians;
        (before, trainer.take_densified().expect("counts"), after)
    };
    let masked = small();
    let (before, plain, left) = exchanged(0.0, &masked);
    let pruned = (0.3 * f64::from(before)) as u32;
    assert_eq!((plain, left), (DensifyCounts { cloned: 0, split: 0, pruned }, before - pruned));
    let (same, split, as_many) = exchanged(0.05, &masked);
    assert_eq!((same, as_many), (before, left), "the numbers of Gaussians do not change");
    assert!(split.split > 0 && f64::from(split.split) <= 0.05 * 0.7 * f64::from(before), "{split:?} of {before}");
    assert_eq!(split.pruned, pruned + split.split);
    let more = exchanged(0.5, &masked).1;
    assert!(more.split > split.split, "{more:?}, and {split:?}");
    let mut bare = masked;
    bare.train.iter_mut().for_each(|view| view.mask = None);
    assert_eq!(exchanged(0.05, &bare).1.split, 0, "no masks, no contours");
}

/// Of the Gaussians, only what the objective names changes, and without a loss nothing does.
#[test]
fn an_objective_trains_what_it_names() {
    let Some(turn) = device() else { return };
    let trained = |objective| {
        let mut trainer = fresh(&turn, TrainerOptions { objective, ..TrainerOptions::default() });
        let before = trainer.model().expect("a model");
        go_on(&mut trainer, 20);
        (before, trainer.model().expect("a model"))
    };
    let (before, after) = trained(Objective { parameters: &[Parameter::Colours], losses: &[Loss::Photo] });
    assert_ne!(before.sh0, after.sh0);
    assert_eq!(before, Gaussians { sh0: before.sh0.clone(), sh_rest: before.sh_rest.clone(), ..after });
    let (before, after) = trained(Objective { parameters: &[Parameter::Positions], losses: &[] });
    assert_eq!(before, after);
}
