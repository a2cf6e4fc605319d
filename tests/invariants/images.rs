//! Images beyond the size of an engine are refused. After growing, the engine renders them as a larger engine does.

use super::training::{small, train, train_with};
use crate::support::device;
use crate::support::scenes::{Shape, scene};
use labelgs::Error;
use labelgs::cli::support::exit_status::exit_status;
use labelgs::engine::{Engine, EngineSize, LabelSize};
use labelgs::label::vote::ballot::{Sweep, Voter, sweep};
use labelgs::render::{Parts, RenderOptions, render};
use labelgs::run::LabelRule;
use labelgs::scene::{Camera, Gaussians, LabelMap};
use labelgs::scheduler::SchedulerOptions;
use labelgs::scheduler::plan::PlanOptions;

/// Guards behind the buffers are checked after each run.
fn guarded() -> SchedulerOptions {
    SchedulerOptions { plan: PlanOptions { guards: true, ..PlanOptions::default() }, ..SchedulerOptions::default() }
}

fn model_and_camera() -> (Gaussians, Camera) {
    let made = scene(231, &Shape { gaussians: 60, width: 64, height: 48, ..Shape::default() });
    (made.gaussians, made.camera)
}

#[track_caller]
fn refused<T>(result: Result<T, Error>) {
    let error = result.err().expect("the image is larger than the engine's");
    assert_eq!(exit_status(&error), 2, "{error}");
    let text = error.to_string();
    let parts = ["64 x 49 px", "64 x 48 px", "grow_image"];
    assert!(parts.iter().all(|part| text.contains(part)), "{text}");
}

#[test]
fn a_camera_that_is_too_large_is_refused() {
    let Some(turn) = device() else { return };
    let (model, camera) = model_and_camera();
    let labels = LabelSize { max_label: 3, layers: 0, vote_columns: 4 };
    let room = EngineSize::new(60, (64, 48)).with_labels(Some(labels));
    let mut engine = Engine::new(turn.gpu(), room, guarded()).expect("an engine");
    engine.upload_model(&model).expect("the model");
    let tall = camera.resized(64, 49);
    refused(render(&mut engine, &tall, &RenderOptions::default()));
    let mask = LabelMap { width: 64, height: 49, ids: vec![1; 64 * 49] };
    let voter = Voter { camera: &tall, mask: &mask.into(), photo: None, trust: None };
    refused(sweep(&mut engine, &[voter], Sweep::new(0.2, 0)));
    render(&mut engine, &camera, &RenderOptions::default()).expect("what fits is rendered as ever");
}

#[test]
fn a_picture_without_a_part_says_so() {
    let Some(turn) = device() else { return };
    let (model, camera) = model_and_camera();
    let mut engine = Engine::new(turn.gpu(), EngineSize::new(60, (64, 48)), guarded()).expect("an engine");
    engine.upload_model(&model).expect("the model");
    let all = render(&mut engine, &camera, &RenderOptions::default()).expect("a picture");
    let colour = render(&mut engine, &camera, &RenderOptions::new(0.2, Parts::COLOUR)).expect("a picture");
    assert_eq!((&all.rgb, &all.alpha), (&colour.rgb, &colour.alpha));
    let labels = vec![1; model.len()];
    assert!(all.main_label_map(&labels).is_ok() && all.label_map().is_ok() && all.mean_depth().is_ok());
    let missing = [colour.main_label_map(&labels).err(), colour.mean_depth().err(), colour.label_map().err()];
    for (error, part) in missing.into_iter().zip(["main Gaussians", "depth", "labels"]) {
        let text = error.expect("refused").to_string();
        assert!(text.contains(part), "{text}");
    }
}

#[test]
fn an_engine_that_has_grown_renders_as_one_made_so_large() {
    let Some(turn) = device() else { return };
    let (model, camera) = model_and_camera();
    let large = camera.resized(200, 150);
    let mut made = Engine::new(turn.gpu(), EngineSize::new(60, (200, 150)), guarded()).expect("an engine");
    made.upload_model(&model).expect("the model");
    let expected = render(&mut made, &large, &RenderOptions::default()).expect("a picture");
    drop(made);
    let mut grown = Engine::new(turn.gpu(), EngineSize::new(60, (64, 48)), guarded()).expect("an engine");
    grown.upload_model(&model).expect("the model");
    let before = render(&mut grown, &camera, &RenderOptions::default()).expect("a picture");
    grown.grow_image(200, 150).expect("it fits");
    assert_eq!(grown.size().image, (200, 150));
    assert_eq!(render(&mut grown, &large, &RenderOptions::default()).expect("a picture"), expected);
    assert_eq!(render(&mut grown, &camera, &RenderOptions::default()).expect("a picture"), before);
    grown.grow_image(10, 180).expect("it fits");
    assert_eq!(grown.size().image, (200, 180), "neither side shrinks");
    drop(grown);
    let size = EngineSize::new(60, (64, 48)).for_training();
    let mut trained = Engine::new(turn.gpu(), size, guarded()).expect("an engine");
    trained.upload_model(&model).expect("the model");
    trained.grow_image(200, 150).expect("it fits");
    let of_trained = render(&mut trained, &large, &RenderOptions::default()).expect("a picture");
    assert!((of_trained.rgb, of_trained.depth) == (expected.rgb, expected.depth), "trained, and grown");
    let after = render(&mut trained, &camera, &RenderOptions::default()).expect("a picture");
    assert_eq!((after.rgb, after.depth), (before.rgb, before.depth));
}

/// A render between two steps, larger than any photo, changes no bit of the training.
#[test]
fn a_training_goes_on_after_a_large_picture() {
    let Some(turn) = device() else { return };
    let options = SchedulerOptions::default();
    let undisturbed = train(&turn, LabelRule::Votes, options, |_| ());
    let large = small().train[0].camera.resized(200, 150);
    let mut pictures = 0;
    let disturbed = train_with(&turn, LabelRule::Votes, options, |trainer| {
        if ![3, 17, 18].contains(&trainer.steps_done()) {
            return Vec::new();
        }
        let error = trainer.engine_mut().grow_image(300, 150).expect_err("steps are in flight");
        assert!(error.to_string().contains("in flight"), "{error}");
        let done = trainer.drain().expect("its steps");
        trainer.engine_mut().grow_image(200, 150).expect("it fits");
        let options = trainer.render_options();
        let picture = render(trainer.engine_mut(), &large, &options).expect("a picture");
        pictures += usize::from(picture.rgb.len() == 200 * 150);
        done
    });
    assert_eq!(pictures, 3);
    assert_eq!(disturbed.losses, undisturbed.losses);
    assert!(disturbed.ply == undisturbed.ply, "the models differ");
}
