//! The viewer: time from a camera to its picture, what watching costs a training, and bytes of page and program.

use super::measure::{median, quantile, require, table, write_json};
use super::trained::{TEST_EVERY, start, trainer, without_masks};
use super::{Common, device};
use labelgs::formats::write_model;
use labelgs::run::TrainConfig;
use labelgs::scenes::camera_json::CameraFile;
use labelgs::synth;
use labelgs::synth::SynthOptions;
use labelgs::{Error, Result};
use serde_json::{Value, json};
use server::{PATIENCE, Page, Server};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

#[allow(dead_code, reason = "the tests need more of it")]
#[path = "../../tests/viewer/server.rs"]
mod server;

/// Shares of the time that viewing may take.
const SHARES: [&str; 2] = ["0.2", "0.5"];

/// Measures all of it.
pub fn run(common: &Common) -> Result<()> {
    let (steps, size, frames, watched) = if common.small { (20, (64, 48), 8, 30) } else { (1700, (640, 480), 60, 400) };
    let folder = tempfile::tempdir().map_err(Error::write("a folder for the scene"))?;
    let (scene, model) = (folder.path().join("scene"), folder.path().join("model.ply"));
    let options = if common.small { super::trained::small_scene() } else { SynthOptions::default() };
    synth::write(&options, &scene, &|_| Ok(()))?;
    let dataset = without_masks(&synth::dataset(&options, TEST_EVERY));
    let config = TrainConfig { iterations: steps, prune_share: 0.0, ..TrainConfig::default() };
    let gpu = device::open()?;
    let mut training = trainer(&gpu, &dataset, &start(&dataset, &config)?, config)?;
    for _ in 0..steps {
        training.step()?;
    }
    let trained = training.model()?;
    write_model(&model, &trained)?;
    drop((training, gpu));

    let cameras = orbit(&scene, size, frames)?;
    let (still, moving, settled) = pictures(folder.path(), &cameras);
    let (count, (width, height)) = (trained.len(), size);
    println!("labelgs view: {count} Gaussians, {width} x {height} px, from the camera to the picture, median and 90 %");
    let row = |name: &str, times: &[f64], note: String| {
        vec![
            name.to_owned(),
            format!("{:.0}", median(times.iter().copied())),
            format!("{:.0}", quantile(&mut times.to_vec(), 0.9)),
            note,
        ]
    };
    let rows = [
        ["camera", "ms", "90 %", "picture"].map(str::to_owned).to_vec(),
        row("still", &still, "full size, exact".to_owned()),
        row("moving", &moving, format!("{} x {} px in the end", settled.0, settled.1)),
    ];
    println!("{}", table(&rows));

    let costs = watching(folder.path(), watched)?;
    println!("\nA training of {watched} steps, s from start to end:");
    let head = ["training", "seconds", "ratio"].map(str::to_owned).to_vec();
    let rows =
        costs.iter().map(|(name, time)| vec![name.clone(), format!("{time:.1}"), format!("{:.2}", time / costs[0].1)]);
    println!("{}", table(&std::iter::once(head).chain(rows).collect::<Vec<_>>()));

    let (page, program) = sizes(folder.path())?;
    println!("\npage {page} bytes, stripped program {program} bytes");
    write_json(
        &common.output.join("view.json"),
        &json!({
            "schema_version": 1, "gaussians": count, "size": [width, height], "still_ms": still, "moving_ms": moving,
            "settled": [settled.0, settled.1], "training_steps": watched,
            "training_s": costs, "page_bytes": page, "program_bytes": program,
        }),
    )
}

/// Cameras on a small arc around the first view of a scene, for pictures of a size.
fn orbit(scene: &Path, (width, height): (u32, u32), count: u32) -> Result<Vec<Value>> {
    let dataset = labelgs::scenes::open(scene, &labelgs::scenes::LoadOptions::default())?;
    let view = dataset.train.first().ok_or_else(|| Error::Bug("the scene has no view".to_owned()))?;
    let mut whole = view.camera.clone();
    let scale = f64::from(width) / f64::from(whole.width);
    (whole.width, whole.height) = (width, height);
    for value in [&mut whole.fx, &mut whole.fy, &mut whole.cx, &mut whole.cy] {
        *value *= scale;
    }
    (0..count)
        .map(|n| {
            let mut camera = whole.clone();
            camera.translation.x += 0.01 * f64::from(n);
            serde_json::to_value(CameraFile::from(&camera)).map_err(|error| Error::Bug(error.to_string()))
        })
        .map(|camera| camera.map(|camera| json!({ "camera": camera })))
        .collect()
}

fn program(folder: &Path, args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_labelgs"));
    command.env("LABELGS_VALIDATION", "off").current_dir(folder).args(args);
    command
}

/// Milliseconds of still and of moving pictures, and the size that moving ones settle at.
fn pictures(folder: &Path, cameras: &[Value]) -> (Vec<f64>, Vec<f64>, (u32, u32)) {
    let server = Server::start(program(folder, &["view", "model.ply", "--scene", "scene"]));
    let mut page = server.page();
    page.hear("scene");
    page.still(&cameras[0], &["colour"]);
    let timed = |work: &mut dyn FnMut()| {
        let start = Instant::now();
        work();
        start.elapsed().as_secs_f64() * 1e3
    };
    let still = cameras.iter().take(10).map(|camera| timed(&mut || drop(page.still(camera, &["colour"])))).collect();
    let mut settled = (0, 0);
    let mut moving = Vec::new();
    for camera in cameras {
        moving.push(timed(&mut || settled = moved(&mut page, camera)));
    }
    // The size settles in the first third.
    (still, moving.split_off(cameras.len() / 3), settled)
}

/// Waits for the picture of a moving camera and returns its size.
fn moved(page: &mut Page, camera: &Value) -> (u32, u32) {
    let seq = page.ask(camera, &["colour"], true);
    loop {
        let frame = page.frame_within(PATIENCE).expect("a frame");
        page.ack(frame.seq);
        if frame.seq == seq {
            return frame.size;
        }
    }
}

/// Seconds of a training, unwatched and watched by a page whose camera moves without rest.
fn watching(folder: &Path, steps: u32) -> Result<Vec<(String, f64)>> {
    let steps = steps.to_string();
    let args = |out| vec!["train", "scene", "--iterations", &steps, "-o", out];
    let begin = Instant::now();
    let status = program(folder, &args("alone")).stdout(Stdio::null()).stderr(Stdio::null()).status();
    let status = status.map_err(|error| Error::Bug(format!("the program does not start: {error}")))?;
    require(status.success(), || "the training failed".to_owned())?;
    let mut found = vec![("unwatched".to_owned(), begin.elapsed().as_secs_f64())];
    for share in SHARES {
        let begin = Instant::now();
        let mut typed = args(share);
        typed.extend(["--view", "--view-share", share]);
        let mut server = Server::train(program(folder, &typed));
        let mut page = server.page();
        page.hear("scene");
        let mut view = 0;
        while let Some(frame) = {
            page.ask(&json!({ "view": view % 4 }), &["colour"], true);
            page.frame_within(Duration::from_secs(20))
        } {
            page.ack(frame.seq);
            view += 1;
        }
        server.child.wait().map_err(|error| Error::Bug(error.to_string()))?;
        found.push((format!("share {share}, {view} pictures"), begin.elapsed().as_secs_f64()));
    }
    Ok(found)
}

/// Bytes of all files of the page, and of the program without symbols.
fn sizes(folder: &Path) -> Result<(u64, u64)> {
    let files = std::fs::read_dir("src/viewer/page").map_err(Error::read("src/viewer/page"))?;
    let page = files.filter_map(|file| Some(file.ok()?.metadata().ok()?.len())).sum();
    let stripped = folder.join("labelgs");
    let strip = Command::new("strip").arg("-o").arg(&stripped).arg(env!("CARGO_BIN_EXE_labelgs")).status();
    require(strip.is_ok_and(|status| status.success()), || "strip, of binutils, does not run".to_owned())?;
    let program = std::fs::metadata(&stripped).map_err(Error::read(&stripped))?.len();
    Ok((page, program))
}
