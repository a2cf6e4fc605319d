//! A run of the library with an observer: its events, its requests, and that neither changes a bit of the result.

use crate::support::runs::Place;
use crate::support::{device, device::Turn};
use labelgs::cli::support::exit_status::exit_status;
use labelgs::render::Parts;
use labelgs::run::{Event, Flow, LiveScene, Observer, Request, Settings, Start, Summary};
use labelgs::scene::Camera;
use labelgs::{Result, run};
use std::collections::BTreeMap;

/// Counts events, downloads the scene, and returns the answer that a test set.
#[derive(Default)]
struct Watcher {
    heard: BTreeMap<&'static str, u32>,
    steps: Vec<u32>,
    /// Answer to a step.
    answers: BTreeMap<u32, Flow>,
    /// Steps between pictures.
    looks_every: u32,
    camera: Option<Camera>,
    pictures: Vec<(u32, usize)>,
}

impl Observer for Watcher {
    fn observe(&mut self, event: &Event<'_>, live: &mut LiveScene<'_>) -> Result<Flow> {
        let name = match event {
            Event::Started { after, .. } => {
                assert_eq!(*after, live.step());
                "started"
            }
            Event::Step { step, is_last, .. } => {
                self.steps.push(*step);
                assert_eq!(*is_last, *step == 40);
                "step"
            }
            Event::Densified { gaussians, .. } => {
                assert_eq!(*gaussians, live.gaussian_count());
                "densified"
            }
            Event::Preview { path, .. } => {
                assert!(path.is_file());
                "preview"
            }
            Event::Model { path, .. } => {
                assert!(path.is_file());
                "model"
            }
            Event::Checkpoint { path, .. } => {
                assert!(path.is_file());
                "checkpoint"
            }
            Event::Evaluated(scores) => {
                assert!(scores.mean.psnr.is_some());
                "evaluated"
            }
            Event::Warning(_) => "warning",
            Event::Paused { .. } => "paused",
            Event::Done(_) => "done",
            _ => "unknown",
        };
        *self.heard.entry(name).or_default() += 1;
        let Event::Step { step, .. } = *event else { return Ok(Flow::Continue) };
        if let Some(camera) = self.camera.as_ref().filter(|_| step.is_multiple_of(self.looks_every)) {
            self.pictures.push((step, live.render(camera, Parts::COLOUR)?.rgb.len()));
        }
        Ok(self.answers.get(&step).copied().unwrap_or_default())
    }
}

fn request<'a>(place: &Place, out: &str, start: Start<'a>) -> Request<'a> {
    let mut request = Request::new(place.path("scene"), place.path(out));
    request.inputs.masks = Some(place.path("scene/masks"));
    request.start = start;
    request
}

fn settings(place: &Place) -> Settings {
    Settings::read(&place.path("settings.toml")).expect("settings")
}

fn train(turn: &Turn, request: &Request, observer: &mut dyn Observer) -> Summary {
    run::train(request, &|| Ok(turn.gpu()), observer).expect("a run")
}

/// A camera that no photo has, larger than all of them.
fn odd_camera(place: &Place) -> Camera {
    let scene = labelgs::scenes::open(&place.path("scene"), &labelgs::scenes::LoadOptions::default()).expect("a scene");
    scene.train[0].camera.resized(201, 117)
}

#[test]
fn a_watched_paused_and_saved_run_has_the_bits_of_an_unwatched_one() {
    let Some(turn) = device() else { return };
    let place = Place::new();
    let alone = train(&turn, &request(&place, "alone", Start::New(settings(&place))), &mut ());
    let mut watcher = Watcher {
        answers: BTreeMap::from([(6, Flow::Pause), (13, Flow::Save), (22, Flow::Pause)]),
        looks_every: 5,
        camera: Some(odd_camera(&place)),
        ..Watcher::default()
    };
    let watched = train(&turn, &request(&place, "watched", Start::New(settings(&place))), &mut watcher);
    assert_eq!(place.model("alone", 40), place.model("watched", 40));
    assert_eq!((alone.steps, alone.gaussians, alone.stopped), (40, watched.gaussians, false));
    assert_eq!(watcher.steps, (1..=40).collect::<Vec<_>>());
    assert_eq!(watcher.pictures, (1..=8).map(|n| (n * 5, 201 * 117)).collect::<Vec<_>>());
    for (name, count) in [("started", 1), ("step", 40), ("paused", 2), ("preview", 6), ("evaluated", 1), ("done", 1)] {
        assert_eq!(watcher.heard.get(name), Some(&count), "{name}: {:?}", watcher.heard);
    }
    // Ten by the schedule and one requested.
    assert_eq!(watcher.heard.get("checkpoint"), Some(&11), "{:?}", watcher.heard);
    assert!(watcher.heard.contains_key("densified") && !watcher.heard.contains_key("unknown"));
}

#[test]
fn a_stopped_run_goes_on_to_the_same_bits() {
    let Some(turn) = device() else { return };
    let place = Place::new();
    train(&turn, &request(&place, "alone", Start::New(settings(&place))), &mut ());
    let mut watcher = Watcher { answers: BTreeMap::from([(18, Flow::Stop)]), ..Watcher::default() };
    let stopped = train(&turn, &request(&place, "parts", Start::New(settings(&place))), &mut watcher);
    assert!(stopped.stopped && stopped.steps == 18 && stopped.scores.is_none() && stopped.model.is_file());
    assert_eq!(place.checkpoints("parts")[0].step, 18);
    let as_before = |found: Option<&Settings>| Ok(found.cloned().expect("a checkpoint"));
    let summary = train(&turn, &request(&place, "parts", Start::Newest(&as_before)), &mut ());
    assert!(summary.scores.is_some());
    assert_eq!(place.model("alone", 40), place.model("parts", 40));
}

#[test]
fn an_error_of_the_observer_ends_the_run() {
    struct Angry;
    impl Observer for Angry {
        fn observe(&mut self, event: &Event<'_>, _: &mut LiveScene<'_>) -> Result<Flow> {
            match event {
                Event::Step { step: 3, .. } => Err(labelgs::Error::Interrupted),
                _ => Ok(Flow::Continue),
            }
        }
    }
    let Some(turn) = device() else { return };
    let place = Place::new();
    let ended = run::train(&request(&place, "out", Start::New(settings(&place))), &|| Ok(turn.gpu()), &mut Angry);
    assert_eq!(exit_status(&ended.expect_err("ended")), 130);
}
