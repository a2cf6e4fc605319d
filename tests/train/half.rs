//! Trainings with packed moments: the same bits again, whatever happens between steps; less memory; states of one kind.

use super::late::{fresh, go_on, options, parts, settings};
use crate::support::device;
use crate::support::device::Turn;
use labelgs::engine::{Engine, EngineSize};
use labelgs::pass::Update;
use labelgs::records::checkpoint::Plane;
use labelgs::run::TrainConfig;
use labelgs::scenes::initial_gaussians;
use labelgs::scheduler::SchedulerOptions;
use labelgs::scheduler::plan::Buf;
use labelgs::train::setup::engine_size;
use labelgs::train::state::TrainState;
use labelgs::train::{Moments, Trainer};

fn half(iterations: u32) -> TrainConfig {
    TrainConfig { moments: Moments::Half, ..settings(iterations) }
}

fn start(turn: &Turn, update: Update, as_card: bool) -> Trainer {
    let scheduler = SchedulerOptions { as_card, ..SchedulerOptions::default() };
    fresh(turn, half(300), options(turn, update, scheduler))
}

fn end(trainer: &mut Trainer) -> Vec<Plane> {
    go_on(trainer, 300);
    trainer.state().expect("a state").planes
}

fn plane<'a>(planes: &'a [Plane], name: &str) -> Option<&'a Plane> {
    planes.iter().find(|plane| plane.name == name)
}

/// By passes and in one kernel, on a processor and with the steps in flight of a card.
#[test]
fn a_training_with_packed_moments_goes_on_to_the_same_bits() {
    let Some(turn) = device() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let mut models = Vec::new();
    for update in [Update::Split, Update::Lazy] {
        let first = end(&mut start(&turn, update, false));
        assert!(end(&mut start(&turn, update, true)) == first, "with more steps in flight");
        let mut stopped = start(&turn, update, false);
        for stop in [3, 140, 257] {
            let path = folder.path().join(stop.to_string());
            go_on(&mut stopped, stop);
            stopped.state().expect("a state").write(&path).expect("a file");
            let state = TrainState::read(&path).expect("a state");
            let scheduler = SchedulerOptions::default();
            let trainer = Trainer::resume(turn.gpu(), &parts(), state, options(&turn, update, scheduler));
            assert!(end(&mut trainer.expect("it goes on")) == first, "{update:?} from step {stop}");
        }
        assert!(end(&mut stopped) == first, "{update:?} after its states were written");
        models.push(first);
    }
    assert!(plane(&models[0], "means") != plane(&models[1], "means"), "the forms of the update round differently");
}

/// A state with late Gaussians goes on where none may be late: they catch up on the host, within a step of their
/// moments.
#[test]
fn late_gaussians_with_packed_moments_catch_up_on_the_host() {
    let Some(turn) = device() else { return };
    let mut late = start(&turn, Update::Lazy, false);
    go_on(&mut late, 160);
    let kept = late.state().expect("a state");
    let touched_at = plane(&kept.planes, "touched_at").expect("some are late").data.clone();
    let split = options(&turn, Update::Split, SchedulerOptions::default());
    let mut split = Trainer::resume(turn.gpu(), &parts(), kept, split).expect("it goes on");
    let on_host = split.state().expect("a state").planes;
    assert!(plane(&on_host, "touched_at").is_none());
    let model = late.model().expect("a model");
    late.engine_mut().catch_up().expect("it catches up");
    let on_device = late.state().expect("a state").planes;
    let floats = |planes: &[Plane], name: &str| -> Vec<f32> {
        plane(planes, name).expect("a plane").data.iter().map(|&word| f32::from_bits(word)).collect()
    };
    let off = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    for name in ["means", "scales", "quats", "sh0", "sh3"] {
        // Roundings of numbers up to 8.
        let found = off(&floats(&on_host, name), &floats(&on_device, name));
        assert!(found < 4e-6, "{name}: {found}");
        let words = |planes: &[Plane]| plane(planes, &format!("m_{name}")).expect("a plane").data.clone();
        let (host, device) = (words(&on_host), words(&on_device));
        let steps = |(a, b): (&u32, &u32)| {
            // One is the nearest, the other one of both around; the ratio follows a root that is one higher or lower,
            // by 7e-4.
            let ratio = |word: u32| i32::from((word >> 16) as u16 as i16);
            ((a & 0xffff).abs_diff(b & 0xffff) > 1)
                || ratio(*a).abs_diff(ratio(*b)) > 2 + ratio(*a).unsigned_abs() / 1400
        };
        let wrong = host.iter().zip(&device).filter(|pair| steps((pair.0, pair.1))).count();
        assert!(wrong == 0 && host != device, "{wrong} of {} words of {name}", host.len());
    }
    let means: Vec<f32> = model.means.iter().zip(&model.opacities).flat_map(|(m, &o)| [m[0], m[1], m[2], o]).collect();
    assert_eq!(means, floats(&on_host, "means"));
    // All caught up at the densification of step 130.
    assert!(touched_at.iter().any(|&at| at < 140), "some are late by 20 updates");
}

/// A word may have the bits of a NaN. A NaN of a parameter is found all the same.
#[test]
fn words_are_no_floats() {
    let Some(turn) = device() else { return };
    let mut trainer = start(&turn, Update::Lazy, false);
    go_on(&mut trainer, 2);
    for buf in [Buf::M_MEANS, Buf::M_SH3] {
        trainer.engine_mut().raw_mut().upload(buf, 0, 5, &[0xffff_ffff_u32, 0x7f80_0000]).expect("upload");
    }
    let state = trainer.state().expect("all is finite");
    assert_eq!(plane(&state.planes, "m_means").expect("a plane").data[20], 0xffff_ffff);
    trainer.engine_mut().raw_mut().upload(Buf::QUATS, 0, 5, &[f32::NAN]).expect("upload");
    assert!(trainer.state().expect_err("a NaN").to_string().contains("quats of Gaussian 5 is not finite"));
}

#[test]
fn a_state_has_moments_of_one_kind() {
    let Some(turn) = device() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("state");
    let mut trainer = start(&turn, Update::Split, false);
    go_on(&mut trainer, 2);
    let state = trainer.state().expect("a state");
    assert!(state.planes.iter().all(|plane| !plane.name.starts_with("u_")), "second moments have no planes");
    let refused = |state: TrainState, part: &str| {
        state.write(&path).expect("a file");
        let text = TrainState::read(&path).expect_err("refused").to_string();
        assert!(text.contains(part), "{text}");
    };
    let mut full = state.clone();
    full.config.moments = Moments::Full;
    refused(full.clone(), "the plane u_means is missing");
    full.planes = fresh(&turn, settings(300), options(&turn, Update::Split, SchedulerOptions::default()))
        .state()
        .expect("a state")
        .planes;
    full.config.moments = Moments::Half;
    refused(full, "is not expected");
}

#[test]
fn packed_moments_take_a_third_less() {
    let Some(turn) = device() else { return };
    let bytes = |half: bool| {
        let size = EngineSize::new(100_000, (160, 120)).for_training().with_half_moments(half);
        let predicted = Engine::predict(&turn.gpu(), &size, SchedulerOptions::default()).expect("it fits");
        let rows = predicted.rows.iter().filter(|row| row.name.starts_with("m_") || row.name.starts_with("u_"));
        (rows.map(|row| row.bytes).sum::<u64>(), predicted.total)
    };
    let ((full, all), (half, less)) = (bytes(false), bytes(true));
    // 15 vec4 a Gaussian.
    assert!(full >= 2 * 240 * 100_000 && (full / 2).abs_diff(half) < 10_000, "{full} {half}");
    assert_eq!(all - less, full - half);
}

#[test]
fn a_run_that_does_not_fit_says_whether_it_does_with_packed_moments() {
    let Some(turn) = device() else { return };
    let (dataset, config) = (parts(), settings(300));
    let model = initial_gaussians(&dataset, config.seed, 5000).expect("points");
    let size = engine_size(&dataset, &config, model.len() as u64).expect("a size");
    let total = |half: bool| {
        let size = size.with_half_moments(half);
        Engine::predict(&turn.gpu(), &size, SchedulerOptions::default()).expect("it fits").total
    };
    let memory_limit = Some(total(true).midpoint(total(false)));
    let start = |config: TrainConfig| {
        let scheduler = SchedulerOptions { memory_limit, ..SchedulerOptions::default() };
        Trainer::new(turn.gpu(), config, &dataset, &model, options(&turn, Update::Split, scheduler))
    };
    let text = start(config).err().expect("too many").to_string();
    assert!(text.contains("it fits with `moments = half`; or lower"), "{text}");
    start(half(300)).map(drop).expect("it fits");
}
