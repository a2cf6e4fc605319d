//! A training that is resumed from a file in a new trainer ends in the same bits as an uninterrupted one.

use super::training::{budgeted, config, labels_of, small};
use crate::support::device;
use crate::support::device::Turn;
use labelgs::Result;
use labelgs::cli::support::exit_status::exit_status;
use labelgs::engine::Engine;
use labelgs::formats::write_model;
use labelgs::records::checkpoint::Plane;
use labelgs::run::{LabelRule, StrategyKind, TrainConfig};
use labelgs::scene::Dataset;
use labelgs::scenes::initial_gaussians;
use labelgs::scheduler::SchedulerOptions;
use labelgs::train::state::TrainState;
use labelgs::train::{StepReport, Trainer};
use std::path::Path;

/// Densification, opacity resets, votes and occluder updates before and after step 30, all at different steps.
fn long(rule: LabelRule) -> TrainConfig {
    TrainConfig { iterations: 60, ..config(rule) }
}

/// Right after an opacity reset; after a densification; before votes; after everything; the last one.
const STOP_STEPS: [u32; 5] = [20, 24, 27, 33, 60];

fn plain() -> Dataset {
    let mut dataset = small();
    dataset.train.iter_mut().for_each(|view| view.mask = None);
    dataset
}

/// Trains to the end. At each stop it writes the state to a file of that name.
fn go_on(trainer: &mut Trainer, stops: &[u32], folder: &Path) -> (Vec<u8>, Vec<u64>) {
    let bits = |reports: Vec<StepReport>| reports.into_iter().map(|r| (r.loss + r.label_loss).to_bits());
    let mut losses = Vec::new();
    while trainer.steps_done() < trainer.config().iterations {
        losses.extend(bits(trainer.step().expect("a step")));
        let step = trainer.steps_done();
        if stops.contains(&step) {
            losses.extend(bits(trainer.drain().expect("its steps")));
            trainer.state().expect("a state").write(&folder.join(step.to_string())).expect("a file");
        }
    }
    losses.extend(bits(trainer.drain().expect("the last steps")));
    let path = folder.join("model.ply");
    write_model(&path, &trainer.labelled_model().expect("a model")).expect("a PLY");
    (std::fs::read(path).expect("the PLY"), losses)
}

fn fresh(turn: &Turn, config: TrainConfig, dataset: &Dataset, options: SchedulerOptions) -> Trainer {
    let start = initial_gaussians(dataset, config.seed, 100).expect("points");
    Trainer::new(turn.gpu(), config, dataset, &start, options).expect("a trainer")
}

fn resume(turn: &Turn, file: &Path, dataset: &Dataset, options: SchedulerOptions) -> Result<Trainer> {
    Trainer::resume(turn.gpu(), dataset, TrainState::read(file)?, options)
}

fn same_when_resumed(turn: &Turn, config: TrainConfig, data: fn() -> Dataset, options: SchedulerOptions) -> Vec<u8> {
    let folder = tempfile::tempdir().expect("a folder");
    let first = go_on(&mut fresh(turn, config.clone(), &data(), options), &[], folder.path());
    let stopped = go_on(&mut fresh(turn, config, &data(), options), &STOP_STEPS, folder.path());
    assert!(stopped == first, "to look at the state changes nothing");
    for stop in STOP_STEPS {
        let file = folder.path().join(stop.to_string());
        let mut trainer = resume(turn, &file, &data(), options).expect("it goes on");
        let again = folder.path().join("again");
        trainer.state().expect("a state").write(&again).expect("a file");
        assert!(
            std::fs::read(&again).expect("bytes") == std::fs::read(&file).expect("bytes"),
            "step {stop}: read back"
        );
        let (ply, losses) = go_on(&mut trainer, &[], folder.path());
        assert_eq!(losses, first.1[stop as usize..], "losses after step {stop}");
        assert!(ply == first.0, "resumed after step {stop}: the models differ");
    }
    first.0
}

fn gaussians_of(ply: &[u8]) -> usize {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("model.ply"), ply).expect("a PLY");
    labelgs::formats::read_model(folder.path().join("model.ply")).expect("a model").gaussians.len()
}

#[test]
fn a_training_with_votes_goes_on_to_the_same_bits() {
    let Some(turn) = device() else { return };
    let ply = same_when_resumed(&turn, long(LabelRule::Votes), small, SchedulerOptions::default());
    assert!(labels_of(&ply) > 10);
}

/// Growing photos, a budget, marks of fog, and near planes of the views, which follow from the first model.
#[test]
fn a_training_within_a_budget_goes_on_to_the_same_bits() {
    let Some(turn) = device() else { return };
    let config = TrainConfig { iterations: 60, ..budgeted() };
    let ply = same_when_resumed(&turn, config, small, SchedulerOptions::default());
    let count = gaussians_of(&ply);
    assert!(count > 600 && count <= 900, "{count} Gaussians within the budget");
    assert!(labels_of(&ply) > 10);
}

/// Relocations, random moves and the terms of opacity and size in the loss.
#[test]
fn a_training_with_relocation_goes_on_to_the_same_bits() {
    let Some(turn) = device() else { return };
    let config = TrainConfig { iterations: 60, strategy: StrategyKind::Mcmc, ..budgeted() };
    let ply = same_when_resumed(&turn, config, small, SchedulerOptions::default());
    let count = gaussians_of(&ply);
    assert!(count > 850 && count <= 900, "{count} Gaussians: the budget is full");
    assert!(labels_of(&ply) > 10);
}

#[test]
fn a_training_by_the_papers_rule_goes_on_to_the_same_bits() {
    let Some(turn) = device() else { return };
    let ply = same_when_resumed(&turn, long(LabelRule::Main), small, SchedulerOptions::default());
    assert!(labels_of(&ply) > 10);
}

#[test]
fn a_training_without_masks_goes_on_to_the_same_bits() {
    let Some(turn) = device() else { return };
    let config = TrainConfig { sh_degree: 2, ..long(LabelRule::Votes) };
    let ply = same_when_resumed(&turn, config, plain, SchedulerOptions::default());
    assert_eq!(labels_of(&ply), 0);
}

/// With little memory, the allowed growth depends on earlier growth.
#[test]
fn a_training_that_memory_bounds_goes_on_to_the_same_bits() {
    let Some(turn) = device() else { return };
    let room = labelgs::train::setup::engine_size(&small(), &long(LabelRule::Votes), 600).expect("views");
    let limit = Engine::predict(&turn.gpu(), &room, SchedulerOptions::default()).expect("it fits").total;
    let options = SchedulerOptions { memory_limit: Some(limit), ..SchedulerOptions::default() };
    let free = go_on(
        &mut fresh(&turn, long(LabelRule::Votes), &small(), SchedulerOptions::default()),
        &[],
        tempfile::tempdir().expect("a folder").path(),
    );
    let bounded = same_when_resumed(&turn, long(LabelRule::Votes), small, options);
    assert!(bounded.len() < free.0.len(), "{limit} bytes bound nothing");
}

#[test]
fn another_scene_is_refused_with_what_differs() {
    let Some(turn) = device() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let options = SchedulerOptions::default();
    let config = TrainConfig { iterations: 6, ..config(LabelRule::Votes) };
    go_on(&mut fresh(&turn, config, &small(), options), &[6], folder.path());
    let file = folder.path().join("6");
    let refusal = |change: &dyn Fn(&mut Dataset), status: i32, parts: &[&str]| {
        let mut dataset = small();
        change(&mut dataset);
        let error = resume(&turn, &file, &dataset, options).err().expect("another scene");
        let text = error.to_string();
        assert_eq!(exit_status(&error), status, "{text}");
        assert!(parts.iter().all(|part| text.contains(part)), "{text}");
    };
    refusal(&|dataset| *dataset = plain(), 2, &["masks: ", "no masks"]);
    refusal(&|dataset| drop(dataset.train.pop()), 3, &["4 training views, but 5"]);
    refusal(&|dataset| dataset.train[1].name = "other.png".into(), 3, &["other.png", "replaces"]);
    refusal(&|dataset| dataset.train[2].camera.fx += 1e-9, 3, &["another camera"]);
    refusal(
        &|dataset| {
            let photo = dataset.train[3].photo.as_mut().expect("a photo");
            photo.edit(|photo| photo.rgba[5][1] ^= 1).expect("in memory");
        },
        3,
        &["another photo"],
    );
    refusal(
        &|dataset| {
            let mask = dataset.train[4].mask.as_mut().expect("a mask");
            mask.edit(|mask| mask.ids[9] ^= 1).expect("in memory");
        },
        3,
        &["another mask"],
    );
    refusal(&|dataset| dataset.train[4].mask = None, 3, &["another mask"]);
    resume(&turn, &file, &small(), options).expect("the same scene");
}

#[test]
fn a_state_that_does_not_fit_together_is_refused() {
    let Some(turn) = device() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let options = SchedulerOptions::default();
    let config = TrainConfig { iterations: 6, ..config(LabelRule::Votes) };
    go_on(&mut fresh(&turn, config, &small(), options), &[6], folder.path());
    let state = TrainState::read(&folder.path().join("6")).expect("it is whole");
    let path = folder.path().join("changed");
    let refusal = |change: &dyn Fn(&mut TrainState), part: &str| {
        let mut changed = state.clone();
        change(&mut changed);
        changed.write(&path).expect("a file");
        let error = resume(&turn, &path, &small(), options).err().unwrap_or_else(|| panic!("{part}: accepted"));
        let text = error.to_string();
        assert_eq!(exit_status(&error), 3, "{text}");
        assert!(text.contains(part) && text.contains("changed"), "{part}: {text}");
    };
    let at = |name: &str| state.planes.iter().position(|plane| plane.name == name).expect("a plane");
    let (means, labels) = (at("means"), at("labels"));
    refusal(&|state| drop(state.planes.remove(means)), "means is missing");
    refusal(&|state| state.planes[means].name = "meanings".into(), "means is missing");
    refusal(&|state| state.planes[means].words = 2, "of 4 are expected");
    refusal(&|state| state.gaussians += 1, "rows of 4 words");
    let other = Plane { name: "other".to_owned(), words: 1, data: vec![0; 3] };
    refusal(&|state| state.planes.push(other.clone()), "is not expected");
    refusal(&|state| state.config.sh_degree = 1, "is not expected");
    refusal(&|state| state.config.sh_degree = 9, "sh_degree");
    refusal(&|state| state.updates = 7, "7 updates");
    refusal(&|state| state.planes[labels].data[0] = 4000, "4000");
}

/// A state that waits on the device is that of its step, whatever the steps after it do, and the training goes on as it
/// would.
#[test]
fn a_state_that_is_read_later_is_of_its_step() {
    let Some(turn) = device() else { return };
    let config = TrainConfig { iterations: 30, ..long(LabelRule::Votes) };
    let mut models = Vec::new();
    for as_card in [false, true] {
        let mut trainer =
            fresh(&turn, config.clone(), &small(), SchedulerOptions { as_card, ..SchedulerOptions::default() });
        let mut waiting = Vec::new();
        while trainer.steps_done() < 30 {
            trainer.step().expect("a step");
            if [9, 20, 21].contains(&trainer.steps_done()) {
                let whole = trainer.state().expect("a state");
                waiting.push((trainer.copied_state().expect("a state"), whole));
            }
        }
        for (later, at_once) in waiting {
            assert!(std::thread::spawn(|| later.whole()).join().expect("a thread").expect("a state") == at_once);
        }
        models.push(trainer.state().expect("a state").planes);
    }
    assert!(models[0] == models[1]);
}
