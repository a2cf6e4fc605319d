//! A scene seen at other sizes than it was trained at, with and without antialiasing, against traced photos of each size.

use super::measure::write_json;
use super::trained::{Judge, TEST_EVERY, Trainings, trained, without_masks};
use super::{Common, device};
use labelgs::Result;
use labelgs::engine::Engine;
use labelgs::render::{Format, Parts, RenderOptions, render, write_rgb};
use labelgs::run::TrainConfig;
use labelgs::scene::{Dataset, Gaussians};
use labelgs::synth;
use labelgs::synth::SynthOptions;
use serde_json::json;
use std::path::Path;
use std::sync::Arc;

/// Sizes of the pictures, by that of the photos of the training.
const SIZES: [f64; 5] = [0.25, 0.5, 1.0, 2.0, 4.0];

/// Options of this benchmark.
#[derive(clap::Args, Clone, Debug)]
pub struct Options {
    #[command(flatten)]
    common: Common,
    #[command(flatten)]
    trainings: Trainings,
}

/// Runs it.
pub fn run(options: &Options) -> Result<()> {
    let gpu = device::open()?;
    let (made, steps, seeds) = options.trainings.plan(options.common.small);
    let scenes = SIZES.map(|size| {
        let side = |pixels: u32| (f64::from(pixels) * size).round() as u32;
        without_masks(&synth::dataset(
            &SynthOptions { width: side(made.width), height: side(made.height), ..made },
            TEST_EVERY,
        ))
    });
    let photos = &scenes[2];
    let mut rows = Vec::new();
    println!("| seed | antialias | Gaussians | {} |", SIZES.map(|size| format!("PSNR at {size}")).join(" | "));
    println!("| --- | --- | --- |{}", " --- |".repeat(SIZES.len()));
    for &seed in seeds {
        for antialias in [false, true] {
            let config = TrainConfig { iterations: steps, seed, antialias, ..TrainConfig::default() };
            let mut trainer = trained(&gpu, photos, config.clone())?;
            let (model, config) = (trainer.model()?, TrainConfig { near: trainer.config().near, ..config });
            let mut found = Vec::new();
            for (scene, size) in scenes.iter().zip(SIZES) {
                let psnr = Judge::new(&gpu, scene)?.scores(scene, &model, &config)?.psnr.unwrap_or(f64::NAN);
                found.push(psnr);
                if seed == seeds[0] {
                    let name = format!("zoom_{size}_{}.png", if antialias { "on" } else { "off" });
                    picture(&gpu, scene, (&model, config.near), &options.common.output.join(name))?;
                }
            }
            let row = found.iter().map(|psnr| format!("{psnr:.2}")).collect::<Vec<_>>().join(" | ");
            println!("| {seed} | {} | {} | {row} |", if antialias { "on" } else { "off" }, model.len());
            rows.push(json!({ "seed": seed, "antialias": antialias, "gaussians": model.len(), "steps": steps,
                "sizes": SIZES, "psnr": found }));
        }
    }
    for (scene, size) in scenes.iter().zip(SIZES) {
        let path = options.common.output.join(format!("zoom_{size}_photo.png"));
        if let Some(view) = scene.test.first() {
            let photo = view.photo()?;
            let rgb: Vec<[f32; 3]> =
                photo.rgba.iter().map(|&[r, g, b, _]| [r, g, b].map(|byte| f32::from(byte) / 255.0)).collect();
            write_rgb(&path, (view.camera.width, view.camera.height), &rgb, Format::Png)?;
        }
    }
    write_json(&options.common.output.join("zoom.json"), &json!({ "schema_version": 1, "rows": rows }))
}

/// Writes the first held-out view as the model shows it.
fn picture(gpu: &Arc<labelgs::gpu::Gpu>, scene: &Dataset, (model, near): (&Gaussians, f32), path: &Path) -> Result<()> {
    let Some(view) = scene.test.first() else { return Ok(()) };
    let size = (view.camera.width, view.camera.height);
    let mut engine = Engine::of_model(Arc::clone(gpu), model, [size])?;
    let drawn = render(&mut engine, &view.camera, &RenderOptions::new(near, Parts::COLOUR))?;
    write_rgb(path, size, &drawn.rgb, Format::Png)
}
