//! What the exposures of a capture cost, and what their matrices take back: a model of the capture is photographed from
//! all its cameras, with one exposure and with the matrices that its photos had, and trained on again.
//!
//! The capture itself has no truth with one exposure. These pictures have, and its cameras, occlusions and gaps.

use super::Common;
use super::measure::write_json;
use super::trained::small_scene;
use super::training::{Plan, Row, Rows, SceneOf, program, scene_of};
use glam::Vec3;
use image::RgbImage;
use image::codecs::jpeg::JpegEncoder;
use labelgs::scene::ColourMatrix;
use labelgs::scenes::{self, LoadOptions};
use labelgs::synth::{self, SynthOptions};
use labelgs::{Error, Result};
use serde_json::json;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Quality of the photos.
const JPEG: u8 = 97;

/// Options of this benchmark.
#[derive(clap::Args, Clone, Debug)]
pub struct Options {
    #[command(flatten)]
    common: Common,
    /// Scene of COLMAP without lenses, with @PX for a longest side [default: the built-in one with exposures that vary].
    #[arg(long, value_name = "DIR[@PX]")]
    scene: Option<String>,
    /// Steps of the model that is photographed.
    #[arg(long, default_value_t = 7000)]
    model_steps: u32,
    /// Steps of the trainings on its pictures.
    #[arg(long, default_value_t = 1700)]
    steps: u32,
    /// Seeds of the trainings on its pictures.
    #[arg(long, value_name = "N,N", value_delimiter = ',', default_values_t = [0, 1, 2])]
    seeds: Vec<u64>,
}

/// Runs it.
pub fn run(options: &Options) -> Result<()> {
    let own = PathBuf::from(env!("CARGO_BIN_EXE_labelgs"));
    let folder = tempfile::tempdir().map_err(Error::write("a folder for scenes"))?;
    let (model_steps, steps, seeds) = match options.common.small {
        true => (40, 20, &options.seeds[..1]),
        false => (options.model_steps, options.steps, options.seeds.as_slice()),
    };
    let capture = match &options.scene {
        Some(text) => scene_of(text, folder.path(), false)?,
        None => made(&folder.path().join("made"), options.common.small)?,
    };
    let [model, pictures] = ["model", "pictures"].map(|name| folder.path().join(name));
    photographed(&own, (&capture, model_steps), (&model, &pictures))?;
    let matrices = matrices(&model)?;
    // Rows are found again by this name.
    let named =
        |what: &str| SceneOf { name: format!("{} after {model_steps}, {what}", capture.name), ..capture.clone() };
    let one = written(&named("one exposure"), &pictures, &folder.path().join("one"), &BTreeMap::new())?;
    let varied = written(&named("its exposures"), &pictures, &folder.path().join("varied"), &matrices)?;

    let mut rows = Rows::open(&options.common.output.join("exposures-rows.jsonl"))?;
    println!("| seed | pictures | exposure | PSNR | corrected | seen | seen, corrected |");
    println!("| --- | --- | --- | --- | --- | --- | --- |");
    let mut found: Vec<Row> = Vec::new();
    for &seed in seeds {
        for (scene, mode) in [(&one, "off"), (&varied, "off"), (&varied, "on")] {
            let flags = ["--exposure", mode].map(str::to_owned);
            let plan = Plan { name: mode, program: &own, flags: &flags, scene, seed, steps };
            let row = rows.row(&plan, &own)?;
            let number = |value: Option<f64>| value.unwrap_or(f64::NAN);
            println!(
                "| {seed} | {} | {mode} | {:.2} | {:.2} | {:.2} | {:.2} |",
                scene.name,
                row.psnr,
                number(row.psnr_corrected),
                number(row.psnr_seen),
                number(row.psnr_seen_corrected)
            );
            found.push(row);
        }
    }
    write_json(&options.common.output.join("exposures.json"), &json!({ "schema_version": 1, "rows": found }))
}

/// The built-in scene with photos of exposures that vary.
fn made(path: &Path, small: bool) -> Result<SceneOf> {
    let options = if small { small_scene() } else { SynthOptions::default() };
    synth::write(&SynthOptions { vary_exposure: true, ..options }, path, &|_| Ok(()))?;
    Ok(SceneOf { name: "made".to_owned(), path: path.to_owned(), max_resolution: 0, masks: None })
}

/// Trains with exposures, and renders the model from all cameras.
fn photographed(own: &Path, (capture, steps): (&SceneOf, u32), (model, pictures): (&Path, &Path)) -> Result<()> {
    let text = |path: &Path| path.to_string_lossy().into_owned();
    let (scene, out, rendered) = (text(&capture.path), text(model), text(pictures));
    let (steps, size) = (steps.to_string(), capture.max_resolution.to_string());
    let train = ["train", &scene, "-o", &out, "--exposure", "on", "--iterations", &steps, "--max-resolution", &size];
    program(own, &[&train[..], &["--preview-every", "0", "--checkpoint-every", "0", "--quiet"]].concat())?;
    program(own, &["render", &out, "--scene", &scene, "--views", "all", "-o", &rendered, "--quiet"]).map(drop)
}

/// The matrices of the training photos, by name.
fn matrices(model: &Path) -> Result<BTreeMap<String, ColourMatrix>> {
    let path = model.join("exposures.json");
    let text = fs::read_to_string(&path).map_err(Error::read(&path))?;
    let problem = |error: serde_json::Error| Error::data(&path, "", error.to_string());
    let file: serde_json::Value = serde_json::from_str(&text).map_err(problem)?;
    serde_json::from_value(file["matrices"].clone()).map_err(problem)
}

/// Makes a scene of the pictures in place of the photos; those with a matrix are exposed by it.
fn written(
    capture: &SceneOf,
    pictures: &Path,
    to: &Path,
    matrices: &BTreeMap<String, ColourMatrix>,
) -> Result<SceneOf> {
    let (from, sparse) = (capture.path.join("sparse/0"), to.join("sparse/0"));
    fs::create_dir_all(&sparse).map_err(Error::write(&sparse))?;
    for name in ["cameras", "images", "points3D"] {
        let file =
            [".bin", ".txt"].map(|end| from.join(format!("{name}{end}"))).into_iter().find(|file| file.is_file());
        let file = file.ok_or_else(|| Error::data(&from, "", format!("has no {name}; expected a model of COLMAP")))?;
        fs::copy(&file, sparse.join(file.file_name().unwrap_or_default())).map_err(Error::read(&file))?;
    }
    for view in scenes::open(&capture.path, &LoadOptions { photos: false, ..LoadOptions::default() })?.all() {
        let path = pictures.join(format!("{}.rgb.png", view.stem()));
        let mut picture = image::open(&path).map_err(|error| Error::data(&path, "", error.to_string()))?.to_rgb8();
        if let Some(matrix) = matrices.get(&view.name) {
            expose(&mut picture, matrix);
        }
        let path = to.join("images").join(&view.name);
        path.parent().map_or(Ok(()), fs::create_dir_all).map_err(Error::write(&path))?;
        let written = match view.name.to_lowercase().ends_with(".png") {
            true => picture.save(&path),
            false => {
                let file = fs::File::create(&path).map_err(Error::write(&path))?;
                picture.write_with_encoder(JpegEncoder::new_with_quality(file, JPEG))
            }
        };
        written.map_err(|error| Error::data(&path, "", error.to_string()))?;
    }
    Ok(SceneOf { path: to.to_owned(), ..capture.clone() })
}

fn expose(picture: &mut RgbImage, rows: &ColourMatrix) {
    let rows = rows.map(Vec3::from_array);
    for pixel in picture.pixels_mut() {
        let colour = Vec3::from_array(pixel.0.map(f32::from));
        pixel.0 = rows.map(|row| row.dot(colour).round().clamp(0.0, 255.0) as u8);
    }
}
