//! Short trainings with densification, labels and occluders give the same bits in every configuration.

use crate::support::compare::{check, exact};
use crate::support::device;
use crate::support::device::Turn;
use labelgs::cli::support::exit_status::exit_status;
use labelgs::engine::Engine;
use labelgs::formats::write_model;
use labelgs::pass::buffers::Capacity;
use labelgs::run::{LabelRule, TrainConfig};
use labelgs::scene::Dataset;
use labelgs::scenes::initial_gaussians;
use labelgs::scheduler::SchedulerOptions;
use labelgs::scheduler::plan::PlanOptions;
use labelgs::synth::{Preset, SynthOptions, dataset};
use labelgs::train::{StepReport, Trainer};
use std::sync::LazyLock;

/// 45 steps in which everything happens: higher degrees, labels by either rule, occluders, densification, an opacity
/// reset.
pub fn config(label_rule: LabelRule) -> TrainConfig {
    TrainConfig {
        iterations: 45,
        label_from: Some(4),
        occlusion_every: Some(15),
        sh_degree_interval: Some(6),
        densify_from: Some(5),
        densify_interval: Some(8),
        densify_grad_threshold: 1e-4,
        opacity_reset_interval: 20,
        opacity_reset_margin: 10,
        // Quick enough for labels in so few steps.
        opacity_lr: 0.3,
        label_threshold: 0.4,
        label_samples: 2,
        label_rule,
        vote_every: Some(12),
        ..TrainConfig::adc()
    }
}

/// 45 steps of the default strategy: photos that grow, a budget, fog that is pruned, labels at full size.
pub fn budgeted() -> TrainConfig {
    TrainConfig {
        iterations: 45,
        start_size: Some(0.5),
        full_size_from: Some(20),
        densify_interval: Some(4),
        densify_grad_threshold: 1e-5,
        budget: 900,
        vote_every: Some(6),
        occlusion_every: Some(8),
        ..TrainConfig::default()
    }
}

/// Five views with masks, made once.
pub fn small() -> Dataset {
    static MADE: LazyLock<Dataset> = LazyLock::new(make_small);
    MADE.clone()
}

fn make_small() -> Dataset {
    let options = SynthOptions {
        preset: Preset::Simple,
        width: 72,
        height: 52,
        views: 5,
        points: 400,
        seed: 3,
        ..SynthOptions::default()
    };
    dataset(&options, 0)
}

/// Results of a training.
#[derive(Debug, PartialEq)]
pub struct Outcome {
    /// The bytes of the PLY.
    pub ply: Vec<u8>,
    /// Losses of all steps, as bits.
    pub losses: Vec<u64>,
    /// Gaussians before and after.
    pub counts: (usize, usize),
    /// Pairs that there was room for in the end.
    pub instances: u64,
    /// Bytes of the device's memory in the end, before the model was read.
    pub memory: u64,
}

/// Trains; `change` may change the trainer before its first step.
pub fn train(turn: &Turn, rule: LabelRule, options: SchedulerOptions, change: impl FnOnce(&mut Trainer)) -> Outcome {
    let mut change = Some(change);
    train_with(turn, rule, options, |trainer| {
        change.take().into_iter().for_each(|change| change(trainer));
        Vec::new()
    })
}

/// Trains and calls `between` before each step; it returns the reports that it drained.
pub fn train_with(
    turn: &Turn,
    rule: LabelRule,
    options: SchedulerOptions,
    mut between: impl FnMut(&mut Trainer) -> Vec<StepReport>,
) -> Outcome {
    let dataset = small();
    let config = config(rule);
    let start = initial_gaussians(&dataset, config.seed, 100).expect("points");
    let has_guards = options.plan.guards;
    let mut trainer = Trainer::new(turn.gpu(), config.clone(), &dataset, &start, options).expect("a trainer");
    let bits = |reports: Vec<StepReport>| reports.into_iter().map(|r| (r.loss + r.label_loss).to_bits());
    let mut losses = Vec::new();
    for _ in 0..config.iterations {
        losses.extend(bits(between(&mut trainer)));
        losses.extend(bits(trainer.step().expect("a step")));
    }
    losses.extend(bits(trainer.drain().expect("the last steps")));
    if has_guards {
        trainer.engine_mut().raw_mut().check_guards().expect("no pass writes outside of its buffers");
    }
    let memory = trainer.engine_mut().raw().memory_total();
    let model = trainer.labelled_model().expect("a model");
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("model.ply");
    write_model(&path, &model).expect("a PLY");
    let instances = trainer.engine_mut().capacity().instances;
    Outcome {
        instances,
        memory,
        ply: std::fs::read(path).expect("the PLY"),
        losses,
        counts: (start.len(), model.len()),
    }
}

#[track_caller]
fn same(what: &str, other: &Outcome, first: &Outcome) {
    assert_eq!(other.counts, first.counts, "{what}: Gaussians");
    check(what, exact(&other.losses, &first.losses));
    assert!(other.ply == first.ply, "{what}: the models differ");
}

/// Capacity that is too small for the first step.
pub fn tiny(trainer: &mut Trainer) {
    let engine = trainer.engine_mut();
    let old = *engine.capacity();
    let layer_pixels = u64::from(engine.shape().tile_pixels());
    let tiny = Capacity { instances: 100, trained_instances: 100, layer_tiles: 1, layer_pixels, ..old };
    engine.set_capacity(tiny).expect("less fits too");
}

fn large(trainer: &mut Trainer) {
    trainer.engine_mut().make_room_for_gaussians(20_000).expect("it fits");
}

#[test]
fn a_training_with_votes_is_the_same_to_the_last_bit() {
    stays_the_same(LabelRule::Votes);
}

#[test]
fn a_training_by_the_papers_rule_is_the_same_to_the_last_bit() {
    stays_the_same(LabelRule::Main);
}

/// The reference run twice; overflows on the way, also with more steps in flight; one barrier before each pass; no
/// shared scratch, and poison in it.
fn stays_the_same(rule: LabelRule) {
    let Some(turn) = device() else { return };
    let plan = PlanOptions::default();
    let with = |plan: PlanOptions| SchedulerOptions { plan, ..SchedulerOptions::default() };
    let first = train(&turn, rule, with(plan), |_| ());
    assert!(first.counts.1 > first.counts.0 + 50, "densification shows: {:?}", first.counts);
    let labelled = labels_of(&first.ply);
    assert!(labelled > 10, "only {labelled} Gaussians have labels");
    same("again", &train(&turn, rule, with(plan), |_| ()), &first);
    let grown = train(&turn, rule, with(plan), tiny);
    assert!(grown.instances > 1000, "{} pairs were enough", grown.instances);
    same("tiny buffers that grow", &grown, &first);
    same("large buffers", &train(&turn, rule, with(plan), large), &first);
    same("barriers", &train(&turn, rule, with(PlanOptions { barrier_everywhere: true, ..plan }), |_| ()), &first);
    let card = train(&turn, rule, SchedulerOptions { as_card: true, ..with(plan) }, tiny);
    same("four steps in flight, photos on the device", &card, &first);
    let alone = PlanOptions { alias: false, guards: true, ..plan };
    let poisoned = SchedulerOptions { poison_step: true, ..with(alone) };
    same("poison", &train(&turn, rule, poisoned, large), &first);
}

#[test]
fn a_memory_limit_bounds_the_gaussians() {
    let Some(turn) = device() else { return };
    let free = train(&turn, LabelRule::Votes, SchedulerOptions::default(), |_| ());
    let (start, end) = free.counts;
    // Room for half of the growth.
    let room = labelgs::train::setup::engine_size(&small(), &config(LabelRule::Votes), (start + end) as u64 / 2)
        .expect("views");
    let limit = Engine::predict(&turn.gpu(), &room, SchedulerOptions::default()).expect("it fits").total;
    assert!(limit < free.memory, "{limit} bytes bound nothing: {} were used", free.memory);
    let options = SchedulerOptions { memory_limit: Some(limit), ..SchedulerOptions::default() };
    let held = train(&turn, LabelRule::Votes, options, |_| ());
    assert!(held.memory <= limit, "{} bytes of {limit}", held.memory);
    assert!(held.counts.1 > start + 20 && held.counts.1 < end - 20, "{:?} and without a limit {end}", held.counts);
    assert!(held.losses.last() != free.losses.last());
    // A limit below the initial need is refused, with the number that would fit.
    let options = SchedulerOptions { memory_limit: Some(8 << 20), ..SchedulerOptions::default() };
    let first = initial_gaussians(&small(), 0, 100).expect("points");
    let refused = Trainer::new(turn.gpu(), config(LabelRule::Votes), &small(), &first, options);
    let error = refused.err().expect("what staging takes leaves nothing for a model");
    assert_eq!(exit_status(&error), 5, "{error}");
}

/// Gaussians with a label in the bytes of a PLY.
pub fn labels_of(ply: &[u8]) -> usize {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("model.ply");
    std::fs::write(&path, ply).expect("a file");
    let read = labelgs::formats::read_model(&path).expect("a PLY");
    read.gaussians.labels.map_or(0, |labels| labels.iter().filter(|&&label| label != 0).count())
}
