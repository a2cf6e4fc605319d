//! Time from the start of the program to its first picture, with empty and with filled caches.

use super::measure::{median, write_json};
use super::{Common, memory};
use labelgs::files::atomic;
use labelgs::formats::write_model;
use labelgs::scenes::camera_json::CameraFile;
use labelgs::{Error, Result};
use serde_json::json;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;

/// Renders one picture of a model on disk with the program itself, caches in a folder of their own.
pub fn run(common: &Common) -> Result<()> {
    let (count, width, height, warm) = if common.small { (500, 64, 48, 1) } else { (100_000, 640, 480, 9) };
    let folder = tempfile::tempdir().map_err(|error| Error::Bug(format!("no temporary folder: {error}")))?;
    let (dataset, model) = memory::scene(count, width, height);
    let ply = folder.path().join("model.ply");
    write_model(&ply, &model)?;
    let camera = folder.path().join("camera.json");
    let first = dataset.train.first().map(|view| &view.camera);
    let first = first.ok_or_else(|| Error::Bug("the scene has no view".to_owned()))?;
    let first = serde_json::to_string(&CameraFile::from(first)).map_err(|error| Error::Bug(error.to_string()))?;
    atomic::write(&camera, |to| to.write_all(first.as_bytes()))?;
    let cold = picture(folder.path(), &ply, &camera)?;
    let times = (0..warm).map(|_| picture(folder.path(), &ply, &camera)).collect::<Result<Vec<_>>>()?;
    let found = median(times.iter().copied());
    println!("labelgs render: a picture of {width} x {height} px of {count} Gaussians, from the start of the program");
    println!("empty caches {cold:.2} s; filled caches {found:.2} s (median of {warm})");
    write_json(
        &common.output.join("start.json"),
        &json!({ "schema_version": 1, "gaussians": count, "size": [width, height], "cold_s": cold, "warm_s": times }),
    )
}

/// Seconds until the program has written its picture and ended.
fn picture(folder: &Path, ply: &Path, camera: &Path) -> Result<f64> {
    let (caches, output) = (folder.join("caches"), folder.join("pictures"));
    let start = Instant::now();
    let mut program = Command::new(env!("CARGO_BIN_EXE_labelgs"));
    program.arg("render").arg(ply).arg("--camera").arg(camera).arg("-o").arg(&output).args(["--what", "rgb", "-q"]);
    program.env("MESA_SHADER_CACHE_DIR", caches.join("driver")).env("LABELGS_CACHE", caches.join("pipelines"));
    let output = program.stdin(Stdio::null()).output();
    let output = output.map_err(|error| Error::Bug(format!("the program does not start: {error}")))?;
    if output.status.success() {
        return Ok(start.elapsed().as_secs_f64());
    }
    Err(Error::Bug(format!("labelgs render failed: {}", String::from_utf8_lossy(&output.stderr).trim())))
}
