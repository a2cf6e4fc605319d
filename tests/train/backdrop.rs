//! Transparent photos, and a colour of its own behind each step.

use crate::support::device::{Turn, device};
use crate::train::exposure::go_on;
use image::{Rgba, RgbaImage};
use labelgs::engine::Engine;
use labelgs::render::{RenderOptions, render};
use labelgs::run::{ExposureMode, TrainConfig};
use labelgs::scene::{Dataset, Gaussians, Photo, View};
use labelgs::scenes::{self, LoadOptions};
use labelgs::scheduler::SchedulerOptions;
use labelgs::synth;
use labelgs::synth::{Preset, SynthOptions};
use labelgs::train::state::TrainState;
use labelgs::train::{Trainer, first_model};
use std::fs;

/// The made scene with nothing but its objects in the photos.
fn cut_out() -> Dataset {
    let (preset, views, points) = (Preset::Simple, 12, 400);
    let options = SynthOptions { preset, width: 64, height: 48, views, points, seed: 5, ..SynthOptions::default() };
    let mut scene = synth::dataset(&options, 8);
    for view in scene.train.iter_mut().chain(&mut scene.test) {
        let mask = view.mask().expect("a mask").expect("a mask");
        let photo = view.photo.as_mut().expect("a photo");
        let clear = |photo: &mut Photo| {
            let outside = photo.rgba.iter_mut().zip(&mask.ids).filter(|(_, id)| **id == 0);
            outside.for_each(|(texel, _)| *texel = [0, 0, 0, 128]);
        };
        photo.edit(clear).expect("an edited photo");
        view.mask = None;
    }
    scene
}

/// Turns every second Gaussian into one that black hides: large, opaque, behind the scene.
fn with_black_things(mut model: Gaussians) -> Gaussians {
    for row in (0..model.len()).step_by(2) {
        model.means[row] = model.means[row].map(|value| 4.0 * value);
        model.scales[row] = [-1.0; 3];
        model.opacities[row] = 2.0;
        model.sh0[row] = [-0.5 / 0.282_094_8; 3];
    }
    model
}

/// Mean opacity of the model where the photos have none.
fn left_outside(trainer: &mut Trainer, scene: &Dataset, turn: &Turn) -> f64 {
    let model = trainer.model().expect("a model");
    let mut engine = Engine::for_model(turn.gpu(), &model, [(64, 48)]).expect("an engine");
    let (mut sum, mut count) = (0.0, 0);
    for view in &scene.test {
        let drawn = render(&mut engine, &view.camera, &RenderOptions::default()).expect("a picture");
        let photo = view.photo().expect("a photo");
        for (alpha, _) in drawn.alpha.iter().zip(&photo.rgba).filter(|(_, texel)| texel[3] == 128) {
            sum += f64::from(*alpha);
            count += 1;
        }
    }
    sum / f64::from(count)
}

/// On a fixed background, what has its colour may stay; on random ones it fades. A resumed training has the same bits.
#[test]
fn nothing_stays_where_photos_are_clear() {
    let Some(turn) = device() else { return };
    let scene = cut_out();
    let fresh = |random_background| {
        let config = TrainConfig {
            iterations: 240,
            random_background,
            far_points: 0,
            prune_share: 0.0,
            ..TrainConfig::default()
        };
        let start = with_black_things(first_model(&scene, &config).expect("a model"));
        Trainer::new(turn.gpu(), config, &scene, &start, SchedulerOptions::default()).expect("a trainer")
    };
    let (mut random, mut fixed) = (fresh(true), fresh(false));
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("state");
    go_on(&mut random, 130).write(&file).expect("a file");
    let expected = go_on(&mut random, 240);
    go_on(&mut fixed, 240);
    let (little, much) = (left_outside(&mut random, &scene, &turn), left_outside(&mut fixed, &scene, &turn));
    assert!(little < 0.2 * much, "{little:.3} with random colours, {much:.3} on black");
    let state = TrainState::read(&file).expect("a state");
    let mut resumed = Trainer::resume(turn.gpu(), &scene, state, SchedulerOptions::default()).expect("it goes on");
    assert_eq!(go_on(&mut resumed, 240).planes, expected.planes);
}

/// Photos to train on keep their opacity, also when shrunk; those that are held out lie over the colour.
#[test]
fn opacity_is_read_where_it_is_wanted() {
    let folder = tempfile::tempdir().expect("a folder");
    let options =
        SynthOptions { preset: Preset::Simple, width: 32, height: 24, views: 4, points: 50, ..SynthOptions::default() };
    synth::write(&options, folder.path(), &|_| Ok(())).expect("a scene");
    for entry in fs::read_dir(folder.path().join("images")).expect("photos") {
        let of = |x: u32| Rgba([200, 100, 0, if x < 16 { 255 } else { 51 }]);
        RgbaImage::from_fn(32, 24, |x, _| of(x)).save(entry.expect("a photo").path()).expect("saved");
    }
    let read = |keep_opacity, max_resolution| {
        let background = [1.0; 3];
        let options =
            LoadOptions { keep_opacity, background, max_resolution, test_every: Some(2), ..LoadOptions::default() };
        scenes::open(folder.path(), &options).expect("a scene")
    };
    let texels = |views: &[View], right: usize| {
        let photo = views[0].photo().expect("a photo");
        [photo.rgba[0], photo.rgba[right]]
    };
    let (solid, mixed) = ([200, 100, 0, 255], [244, 224, 204, 255]);
    let scene = read(false, None);
    assert_eq!(texels(&scene.train, 31), [solid, mixed]);
    for (longest, right) in [(None, 31), (Some(16), 15)] {
        let scene = read(true, longest);
        assert_eq!(texels(&scene.train, right), [solid, [40, 20, 0, 128 + 25]]);
        assert_eq!(texels(&scene.test, right), [solid, mixed]);
    }
}

#[test]
fn gains_need_one_background() {
    let on = TrainConfig { random_background: true, ..TrainConfig::default() };
    on.check().expect("settings");
    let error = TrainConfig { exposure: ExposureMode::On, ..on }.check().expect_err("both");
    assert!(error.to_string().contains("exposure"), "{error}");
}
