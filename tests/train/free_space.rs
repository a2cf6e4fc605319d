//! The rules against fog beside the cameras spare things that are near.

use crate::support::device;
use glam::{DMat3, DVec3};
use labelgs::engine::Engine;
use labelgs::render::{NEAR_DEFAULT, Parts, Render, RenderOptions, render};
use labelgs::run::TrainConfig;
use labelgs::scene::{Camera, Dataset, Gaussians, Photo, Point, View};
use labelgs::scenes::init;
use labelgs::scheduler::SchedulerOptions;
use labelgs::train::Trainer;

const IMAGE_SIZE: (u32, u32) = (96, 72);
/// Depths of a wall and of a ball before it: most Gaussians belong to the wall.
const WALL_DEPTH: f64 = 4.0;
const BALL_DEPTH: f64 = 0.3 * WALL_DEPTH;
const STEP_COUNT: u32 = 300;

fn camera(x: f64, y: f64) -> Camera {
    Camera {
        rotation: DMat3::IDENTITY,
        translation: DVec3::new(-x, -y, 0.0),
        fx: 80.0,
        fy: 80.0,
        cx: 48.0,
        cy: 36.0,
        width: IMAGE_SIZE.0,
        height: IMAGE_SIZE.1,
    }
}

fn add(model: &mut Gaussians, at: DVec3, deviation: f64, colour: [f64; 3]) {
    model.means.push(at.to_array().map(|value| value as f32));
    model.quats.push([1.0, 0.0, 0.0, 0.0]);
    model.scales.push([deviation.ln() as f32; 3]);
    model.opacities.push(4.0);
    model.sh0.push(colour.map(|value| ((value - 0.5) / 0.282_094_8) as f32));
}

fn wall() -> Gaussians {
    let mut model = Gaussians::default();
    for (x, y) in (-20..=20).flat_map(|x| (-16..=16).map(move |y| (f64::from(x), f64::from(y)))) {
        let colour = [0.3 + 0.2 * (0.7 * x).sin(), 0.5 + 0.2 * (0.5 * y).cos(), 0.4 + 0.1 * (0.3 * (x + y)).sin()];
        add(&mut model, DVec3::new(0.2 * x, 0.2 * y, WALL_DEPTH), 0.12, colour);
    }
    model
}

/// A ball of bright patches.
fn ball() -> Gaussians {
    let mut model = Gaussians::default();
    for i in 0..80 {
        // A spiral over the sphere.
        let (z, turn) = (1.0 - (2.0 * f64::from(i) + 1.0) / 80.0, 2.399_963 * f64::from(i));
        let side = (1.0 - z * z).sqrt();
        let place = DVec3::new(side * turn.cos(), side * turn.sin(), z);
        let colour = [0.9, 0.75 + 0.2 * place.x, 0.1 + 0.1 * place.y];
        add(&mut model, DVec3::new(0.05, 0.0, BALL_DEPTH) + 0.15 * place, 0.03, colour);
    }
    model
}

fn joined(mut model: Gaussians, other: Gaussians) -> Gaussians {
    model.means.extend(other.means);
    model.quats.extend(other.quats);
    model.scales.extend(other.scales);
    model.opacities.extend(other.opacities);
    model.sh0.extend(other.sh0);
    model
}

fn draw(engine: &mut Engine, camera: &Camera) -> Render {
    let options = RenderOptions { parts: Parts::DEPTH, ..RenderOptions::for_main(NEAR_DEFAULT) };
    render(engine, camera, &options).expect("a picture")
}

fn photo(picture: &Render) -> Photo {
    let byte = |value: f32| (value.clamp(0.0, 1.0) * 255.0).round() as u8;
    let rgba = picture.rgb.iter().map(|&[r, g, b]| [byte(r), byte(g), byte(b), 255]).collect();
    Photo { width: IMAGE_SIZE.0, height: IMAGE_SIZE.1, rgba }
}

#[test]
fn a_thing_at_a_third_of_the_median_depth_is_drawn() {
    let Some(turn) = device() else { return };
    let truth = joined(wall(), ball());
    let engine = |model: &Gaussians| Engine::for_model(turn.gpu(), model, [IMAGE_SIZE]).expect("an engine");
    let mut of_truth = engine(&truth);
    let places = (0..9).map(|i| (0.25 * f64::from(i % 3 - 1), 0.2 * f64::from(i / 3 - 1)));
    let train: Vec<View> = (places.enumerate())
        .map(|(i, (x, y))| {
            let camera = camera(x, y);
            let photo = photo(&draw(&mut of_truth, &camera));
            View { name: format!("{i}.png"), camera, photo: Some(photo.into()), mask: None }
        })
        .collect();
    // Every third Gaussian of the truth is a point of the reconstruction.
    let colour = |sh: [f32; 3]| sh.map(|value| ((value * 0.282_094_8 + 0.5) * 255.0) as u8);
    let point = |row: usize| Point { position: truth.world(row), colour: colour(truth.sh0[row]) };
    let points = (0..truth.len()).step_by(3).map(point).collect();
    let data = Dataset { train, points, ..Dataset::default() };
    let config = TrainConfig { iterations: STEP_COUNT, ..TrainConfig::default() };
    let first = init::initial_gaussians(&data, 0, 100).expect("a model");
    let mut trainer = Trainer::new(turn.gpu(), config, &data, &first, SchedulerOptions::default()).expect("a trainer");
    for _ in 0..STEP_COUNT {
        trainer.step().expect("a step");
    }
    let model = trainer.labelled_model().expect("the model");

    let held_out = camera(0.1, -0.1);
    let (seen, real) = (draw(&mut engine(&model), &held_out), draw(&mut of_truth, &held_out));
    let cover = draw(&mut engine(&ball()), &held_out).alpha;
    let ball: Vec<usize> = (0..cover.len()).filter(|&index| cover[index] > 0.9).collect();
    assert!(ball.len() > 200, "{} pixels", ball.len());
    let error =
        |&index: &usize| (0..3).map(|c| f64::from(seen.rgb[index][c] - real.rgb[index][c]).powi(2)).sum::<f64>();
    let psnr = -10.0 * (ball.iter().map(error).sum::<f64>() / (3.0 * ball.len() as f64)).log10();
    let depths = seen.mean_depth().expect("a depth");
    let before =
        ball.iter().filter(|&&index| depths[index] > 0.0 && f64::from(depths[index]) < 0.5 * WALL_DEPTH).count();
    println!("ball: {psnr:.1} dB, {before} of {} pixels before the wall", ball.len());
    // Without the ball the wall's colours are there, at 8 dB.
    assert!(psnr > 30.0, "the ball has {psnr:.1} dB");
    assert!(10 * before > 9 * ball.len(), "{before} of {} pixels of the ball lie before the wall", ball.len());
}
