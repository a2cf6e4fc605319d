//! Gaussians that are late: they are where every step would have moved them, whoever looks and however a training is
//! cut.

use crate::invariants::training::{budgeted, small, tiny};
use crate::support::device;
use crate::support::device::Turn;
use crate::support::scenes::{generator, uniform};
use labelgs::engine::Engine;
use labelgs::pass::{KernelShape, Update};
use labelgs::records::checkpoint::Plane;
use labelgs::render::render;
use labelgs::run::TrainConfig;
use labelgs::scene::Dataset;
use labelgs::scenes::initial_gaussians;
use labelgs::scheduler::SchedulerOptions;
use labelgs::train::Trainer;
use labelgs::train::setup::TrainerOptions;
use labelgs::train::state::TrainState;

/// Photos of small parts of the scene, so that most show little of it.
pub(super) fn parts() -> Dataset {
    let mut dataset = small();
    for view in &mut dataset.train {
        view.mask = None;
        (view.camera.fx, view.camera.fy) = (5.0 * view.camera.fx, 5.0 * view.camera.fy);
    }
    dataset
}

/// Steps of the default strategy with a few densifications, and marks of fog in each.
pub(super) fn settings(iterations: u32) -> TrainConfig {
    TrainConfig {
        iterations,
        densify_from: Some(10),
        densify_interval: Some(130),
        sh_degree_interval: Some(1),
        start_size: Some(1.0),
        full_size_from: Some(1),
        ..budgeted()
    }
}

pub(super) fn options(turn: &Turn, update: Update, scheduler: SchedulerOptions) -> TrainerOptions {
    let shape = KernelShape { update, group_walks: true, ..KernelShape::for_device(turn.capabilities()) };
    TrainerOptions { shape: Some(shape), scheduler, ..TrainerOptions::default() }
}

pub(super) fn fresh(turn: &Turn, config: TrainConfig, options: TrainerOptions) -> Trainer {
    let dataset = parts();
    let start = initial_gaussians(&dataset, config.seed, 100).expect("points");
    Trainer::new(turn.gpu(), config, &dataset, &start, options).expect("a trainer")
}

pub(super) fn go_on(trainer: &mut Trainer, until: u32) {
    while trainer.steps_done() < until {
        trainer.step().expect("a step");
    }
    trainer.drain().expect("its steps");
}

fn find<'a>(planes: &'a [Plane], name: &str) -> Option<&'a Plane> {
    planes.iter().find(|plane| plane.name == name)
}

fn floats(planes: &[Plane], name: &str) -> Vec<f32> {
    find(planes, name).expect("a plane").data.iter().map(|&word| f32::from_bits(word)).collect()
}

const ATTRIBUTES: [&str; 7] = ["means", "scales", "quats", "sh0", "sh1", "sh2", "sh3"];

/// Largest differences of parameters, and of moments relative to themselves, of the Gaussians that `counts` names.
fn differences(a: &[Plane], b: &[Plane], counts: impl Fn(usize) -> bool) -> [f64; 3] {
    let mut most = [0.0_f64; 3];
    for name in ATTRIBUTES {
        for (k, prefix) in ["", "m_", "u_"].into_iter().enumerate() {
            let name = format!("{prefix}{name}");
            let words = find(a, &name).expect("a plane").words as usize;
            let pairs = floats(a, &name).into_iter().zip(floats(b, &name)).enumerate();
            for (_, (a, b)) in pairs.filter(|(at, _)| counts(at / words)) {
                // First moments that have all but faded are as good as 0.
                let scale = if k == 0 { 1.0 } else { f64::from(b.abs()).max(1e-25) };
                most[k] = most[k].max(f64::from((a - b).abs()) / scale);
            }
        }
    }
    most
}

/// Gives moments to Gaussians that have none, which no view shows: moves of a few learning rates in all.
fn push(state: &mut TrainState) {
    let mut random = generator(5);
    for plane in &mut state.planes {
        let is_second = plane.name.starts_with("u_");
        if !is_second && !plane.name.starts_with("m_") {
            continue;
        }
        for word in plane.data.iter_mut().filter(|word| **word == 0) {
            let value = if is_second { uniform(&mut random, 1e-6, 1e-5) } else { uniform(&mut random, -2e-3, 2e-3) };
            *word = (value as f32).to_bits();
        }
    }
}

/// Which Gaussians had no gradient in some steps: their first moments faded, to a millionth of a millionth in the end.
fn resting(before: &[Plane], after: &[Plane], steps: u32) -> Vec<bool> {
    let factor = 0.9_f64.powi(steps as i32);
    let (before, after) = (floats(before, "m_means"), floats(after, "m_means"));
    let fades = |(&a, &b): (&f32, &f32)| (f64::from(b) / (factor * f64::from(a)) - 1.0).abs() < 1e-4;
    let pairs = before.as_chunks::<4>().0.iter().zip(after.as_chunks::<4>().0);
    pairs.map(|(a, b)| a.iter().zip(b).all(fades)).collect()
}

/// From equal states on, for fewer and more steps than may be missed: late Gaussians without a gradient are where those
/// of every step are, on the device, on the host, and in a training that goes on with a pass for each part of an
/// update.
#[test]
fn late_gaussians_are_where_every_step_moves_them() {
    let Some(turn) = device() else { return };
    let fixed =
        |update| TrainerOptions { strategy: Some(Box::new(())), ..options(&turn, update, SchedulerOptions::default()) };
    let mut every = fresh(&turn, settings(600), fixed(Update::Lazy));
    let mut late = fresh(&turn, settings(600), fixed(Update::Lazy));
    let mut oldest = 0;
    for until in [5, 6, 15, 60, 300, 565] {
        every.engine_mut().catch_up().expect("it catches up");
        let mut state = every.state().expect("a state");
        if state.step > 3 {
            push(&mut state);
            every.restore(&state).expect("it goes on");
        }
        assert!(find(&state.planes, "missed_updates").is_none(), "nothing is missed");
        late.restore(&state).expect("it goes on");
        while every.steps_done() < until {
            let next = every.steps_done() + 1;
            go_on(&mut every, next);
            every.engine_mut().catch_up().expect("it catches up");
        }
        go_on(&mut late, until);
        let kept = late.state().expect("a state");
        let (touched_at, missed) = (find(&kept.planes, "touched_at"), find(&kept.planes, "missed_updates"));
        let (touched_at, head) = (&touched_at.expect("late ones").data, &missed.expect("late ones").data[..2]);
        // The numbers of updates start anew, and all caught up once in more than 255 steps.
        let (now, whole) = (head[0], head[1]);
        assert_eq!(now, until - state.step);
        oldest = oldest.max(now - whole);
        let at_end = touched_at.iter().filter(|&&at| at <= whole).count();
        assert!(at_end > 50, "{at_end} of {} are late", touched_at.len());
        every.engine_mut().catch_up().expect("it catches up");
        let expected = every.state().expect("a state").planes;
        let rests = resting(&state.planes, &expected, until - state.step);
        let count = rests.iter().filter(|rests| **rests).count();
        assert!(state.step == 0 || count > 50, "{count} of {} have no gradient", rests.len());
        let mut split = Trainer::resume(turn.gpu(), &parts(), kept.clone(), fixed(Update::Split));
        let on_host = split.as_mut().expect("it goes on").state().expect("a state").planes;
        let model = late.model().expect("a model");
        late.engine_mut().catch_up().expect("it catches up");
        let on_device = late.state().expect("a state").planes;
        for (place, found) in [("device", &on_device), ("host", &on_host)] {
            // Those that steps touch go ways of their own: Adam makes whole steps of rounding errors.
            let [parameters, first, second] = differences(found, &expected, |row| rests[row]);
            println!("{until} on the {place}: {parameters:e} {first:e} {second:e}");
            // Roundings of numbers up to 8, of which every step has one.
            assert!(parameters < 1e-5 && first < 4e-6 && second < 4e-6, "{parameters} {first} {second}");
        }
        // The same sums, rounded once.
        let means: Vec<f32> =
            model.means.iter().zip(&model.opacities).flat_map(|(m, &o)| [m[0], m[1], m[2], o]).collect();
        assert_eq!(means, floats(&on_host, "means"));
        let rounded = differences(&on_host, &on_device, |_| true);
        assert!(rounded[0] < 1e-6 && rounded[1] < 1e-6 && rounded[2] < 1e-6, "{rounded:?}");
    }
    assert!(oldest == 240, "{oldest} updates are the most that were missed");
}

/// Bits of a training: losses, and the state in the end.
fn train(turn: &Turn, scheduler: SchedulerOptions, mut between: impl FnMut(&mut Trainer)) -> (Vec<u64>, Vec<Plane>) {
    let mut trainer = fresh(turn, settings(300), options(turn, Update::Lazy, scheduler));
    let mut losses = Vec::new();
    while trainer.steps_done() < 300 {
        between(&mut trainer);
        losses.extend(trainer.step().expect("a step").into_iter().map(|report| report.loss.to_bits()));
    }
    losses.extend(trainer.drain().expect("its steps").into_iter().map(|report| report.loss.to_bits()));
    (losses, trainer.state().expect("a state").planes)
}

#[test]
fn growth_and_steps_in_flight_change_no_bit_of_a_late_training() {
    let Some(turn) = device() else { return };
    let first = train(&turn, SchedulerOptions::default(), |_| ());
    assert!(find(&first.1, "missed_updates").is_some(), "Gaussians are late");
    assert!(train(&turn, SchedulerOptions::default(), |_| ()) == first, "again");
    let card = SchedulerOptions { as_card: true, ..SchedulerOptions::default() };
    let mut is_first = true;
    let grown = train(&turn, card, |trainer| {
        if std::mem::take(&mut is_first) {
            tiny(trainer);
        }
    });
    assert!(grown == first, "four steps in flight, and buffers that grow");
}

/// A training that is looked at, and others that go on from its states.
#[test]
fn a_late_training_goes_on_to_the_same_bits() {
    let Some(turn) = device() else { return };
    let lazy = || options(&turn, Update::Lazy, SchedulerOptions::default());
    let end = |trainer: &mut Trainer| {
        go_on(trainer, 300);
        trainer.state().expect("a state").planes
    };
    let first = end(&mut fresh(&turn, settings(300), lazy()));
    let mut looked = fresh(&turn, settings(300), lazy());
    let folder = tempfile::tempdir().expect("a folder");
    let stops = [3, 140, 257];
    for stop in stops {
        go_on(&mut looked, stop);
        looked.state().expect("a state").write(&folder.path().join(stop.to_string())).expect("a file");
        let (options, camera) = (looked.render_options(), looked.views()[1].camera.clone());
        let picture = render(looked.engine_mut(), &camera, &options).expect("a picture");
        let model = looked.model().expect("a model");
        let mut other = Engine::for_model(turn.gpu(), &model, [(camera.width, camera.height)]).expect("it fits");
        let expected = render(&mut other, &camera, &options).expect("a picture");
        let off = |(a, b): (&[f32; 3], &[f32; 3])| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        let most = picture.rgb.iter().zip(&expected.rgb).map(off).fold(0.0, f32::max);
        // What is late rounds otherwise on the host.
        assert!(most < 2e-5, "a picture shows Gaussians that have caught up: {most}");
    }
    assert!(end(&mut looked) == first, "to look changes nothing");
    for stop in stops {
        let state = TrainState::read(&folder.path().join(stop.to_string())).expect("a state");
        assert!(find(&state.planes, "missed_updates").is_some(), "Gaussians are late after step {stop}");
        let mut trainer = Trainer::resume(turn.gpu(), &parts(), state, lazy()).expect("it goes on");
        assert!(end(&mut trainer) == first, "from step {stop}");
    }
}
