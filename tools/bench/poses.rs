//! Poses of a made scene that are off, trained with and without refinement: what is left of the errors, and the quality
//! from held-out cameras.

use super::measure::write_json;
use super::trained::{Judge, TEST_EVERY, Trainings, trained, without_masks};
use super::{Common, device};
use glam::{DMat3, DVec3};
use labelgs::Result;
use labelgs::gpu::Gpu;
use labelgs::internals::scheduler::SchedulerOptions;
use labelgs::internals::train::aligned;
use labelgs::run::TrainConfig;
use labelgs::scene::{Camera, Dataset, View};
use labelgs::synth;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg32;
use serde_json::json;
use std::sync::Arc;

/// Options of this benchmark.
#[derive(clap::Args, Clone, Debug)]
pub struct Options {
    #[command(flatten)]
    common: Common,
    #[command(flatten)]
    trainings: Trainings,
    /// Error of a camera's direction, degrees.
    #[arg(long, default_value_t = 0.5)]
    degrees: f64,
    /// Error of a camera's place, as a share of its distance from the middle of the points.
    #[arg(long, default_value_t = 0.01)]
    distance: f64,
}

/// Mean errors of the poses of the training views: degrees, and shares of the distance.
#[derive(Clone, Copy, Debug)]
struct Errors {
    degrees: f64,
    distance: f64,
}

/// Runs it.
pub fn run(options: &Options) -> Result<()> {
    let gpu = device::open()?;
    let (made, steps, seeds) = options.trainings.plan(options.common.small);
    let truth = without_masks(&synth::dataset(&made, TEST_EVERY));
    println!("| seed | poses | degrees off | distance off | PSNR | with held-out poses refined |");
    println!("| --- | --- | --- | --- | --- | --- |");
    let mut rows = Vec::new();
    for &seed in seeds {
        let spoilt = disturbed(&truth, seed, (options.degrees, options.distance));
        for (name, dataset, refine_poses) in [
            ("exact", &truth, false),
            ("exact, refined", &truth, true),
            ("off", &spoilt, false),
            ("off, refined", &spoilt, true),
        ] {
            let config = TrainConfig { iterations: steps, seed, refine_poses, ..TrainConfig::default() };
            let (errors, psnr, aligned) = scored(&gpu, (dataset, &truth), config)?;
            println!("| {seed} | {name} | {:.3} | {:.5} | {psnr:.2} | {aligned:.2} |", errors.degrees, errors.distance);
            rows.push(json!({ "seed": seed, "poses": name, "degrees": errors.degrees, "distance": errors.distance,
                "psnr": psnr, "psnr_refined": aligned, "steps": steps }));
        }
    }
    write_json(&options.common.output.join("poses.json"), &json!({ "schema_version": 1, "rows": rows }))
}

/// The scene with errors of the training poses: directions and places in random directions.
fn disturbed(truth: &Dataset, seed: u64, (degrees, share): (f64, f64)) -> Dataset {
    let mut random = Pcg32::seed_from_u64(seed);
    let mut direction = move || {
        loop {
            let v = DVec3::from_array([(); 3].map(|()| random.random_range(-1.0..1.0)));
            if (0.01..1.0).contains(&v.length()) {
                return v.normalize();
            }
        }
    };
    let (middle, mut spoilt) = (middle(truth), truth.clone());
    for view in &mut spoilt.train {
        let far = view.camera.centre().distance(middle);
        let (turn, shift) = (degrees.to_radians() * direction(), share * far * direction());
        view.camera = view.camera.corrected(turn, shift);
    }
    spoilt
}

fn middle(dataset: &Dataset) -> DVec3 {
    dataset.points.iter().map(|point| point.position).sum::<DVec3>() / dataset.points.len().max(1) as f64
}

/// Trains, and scores the model from the held-out cameras as the trained ones see them, and once more after the model has
/// refined their poses.
fn scored(gpu: &Arc<Gpu>, (dataset, truth): (&Dataset, &Dataset), config: TrainConfig) -> Result<(Errors, f64, f64)> {
    let mut trainer = trained(gpu, dataset, config.clone())?;
    let model = trainer.model()?;
    let refined = trainer.poses()?;
    let config = TrainConfig { near: trainer.config().near, ..config };
    let exact: Vec<&Camera> = truth.train.iter().map(|view| &view.camera).collect();
    let found: Vec<&Camera> =
        dataset.train.iter().map(|view| refined.get(&view.name).unwrap_or(&view.camera)).collect();
    let fit = Similarity::of(&exact, &found);
    let mut seen = dataset.clone();
    seen.test.iter_mut().for_each(|view| view.camera = fit.moved(&view.camera));
    let mut judge = Judge::new(gpu, &seen)?;
    let mut psnr = |of: &Dataset| Ok(judge.scores(of, &model, &config)?.psnr.unwrap_or(f64::NAN));
    let before = psnr(&seen)?;
    let views: Vec<&View> = seen.test.iter().collect();
    let scheduler = SchedulerOptions::default();
    let refined =
        Dataset { test: aligned(gpu, &model, &views, (config.near, config.background), scheduler)?, ..seen.clone() };
    Ok((fit.errors(&exact, &found, middle(truth)), before, psnr(&refined)?))
}

/// The turn, size and move that carry one set of cameras to another: photos alone do not tell them.
#[derive(Clone, Copy, Debug)]
struct Similarity {
    turn: DMat3,
    scale: f64,
    from: DVec3,
    to: DVec3,
}

impl Similarity {
    /// The mean of the turns between the cameras, and the least squares of their centres after it.
    fn of(exact: &[&Camera], found: &[&Camera]) -> Self {
        let count = exact.len() as f64;
        let mean = |cameras: &[&Camera]| cameras.iter().map(|camera| camera.centre()).sum::<DVec3>() / count;
        let (from, to) = (mean(exact), mean(found));
        let sum = exact.iter().zip(found).fold(glam::DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0), |sum, (a, b)| {
            let q = glam::DQuat::from_mat3(&(b.rotation.transpose() * a.rotation));
            if q.w < 0.0 { sum - q } else { sum + q }
        });
        let turn = DMat3::from_quat(sum.normalize());
        let pairs = || exact.iter().zip(found).map(|(a, b)| (turn * (a.centre() - from), b.centre() - to));
        let scale = pairs().map(|(a, b)| a.dot(b)).sum::<f64>() / pairs().map(|(a, _)| a.length_squared()).sum::<f64>();
        Self { turn, scale, from, to }
    }

    fn moved(&self, camera: &Camera) -> Camera {
        let rotation = camera.rotation * self.turn.transpose();
        let centre = self.to + self.scale * (self.turn * (camera.centre() - self.from));
        Camera { rotation, translation: -(rotation * centre), ..camera.clone() }
    }

    fn errors(&self, exact: &[&Camera], found: &[&Camera], middle: DVec3) -> Errors {
        let count = exact.len() as f64;
        let mut errors = Errors { degrees: 0.0, distance: 0.0 };
        for (exact, found) in exact.iter().zip(found) {
            let moved = self.moved(exact);
            let turn = glam::DQuat::from_mat3(&(found.rotation * moved.rotation.transpose()));
            errors.degrees += 2.0 * turn.xyz().length().asin().to_degrees() / count;
            let far = exact.centre().distance(middle);
            errors.distance += moved.centre().distance(found.centre()) / (self.scale * far) / count;
        }
        errors
    }
}
