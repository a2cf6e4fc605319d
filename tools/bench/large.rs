//! A city larger than the device's memory: host time and memory of rendering, listing and extracting an object.

use super::Common;
use super::measure::{table, write_json};
use glam::{DMat3, DVec3};
use labelgs::files::atomic;
use labelgs::formats::write_model;
use labelgs::scene::{Camera, Gaussians};
use labelgs::scenes::camera_json::CameraFile;
use labelgs::{Error, Result};
use rand::rngs::SmallRng;
use rand::{Rng, SeedableRng};
use serde_json::{Value, json};
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Size of a city block, world units.
const BLOCK_SIZE: f64 = 60.0;
/// Degree of the spherical harmonics.
const SH_DEGREE: u32 = 3;
/// The first label, which masks cannot have.
const FIRST_LABEL: usize = 70_000;

/// Options of the benchmark.
#[derive(clap::Args, Clone, Debug)]
pub struct Options {
    /// Size and output.
    #[command(flatten)]
    pub common: Common,
    /// Gaussians, in millions.
    #[arg(long, value_name = "N", default_value_t = 10)]
    pub millions: usize,
}

/// Measures the program in separate processes.
pub fn run(options: &Options) -> Result<()> {
    let common = &options.common;
    let (count, side, size, limit) = match common.small {
        true => (30_000, 3, (64, 48), "16M"),
        false => (options.millions * 1_000_000, 20, (1280, 720), "1G"),
    };
    let folder = tempfile::tempdir_in(&common.output).or_else(|_| tempfile::tempdir());
    let folder = folder.map_err(Error::write("a folder for the city"))?;
    let (ply, part) = (folder.path().join("city.ply"), folder.path().join("part.ply"));
    write_city(&ply, count, side)?;
    let ply = ply.to_string_lossy().into_owned();
    let object = (FIRST_LABEL + side + 1).to_string();
    let mut runs = vec![("list", vec!["list".to_owned(), ply.clone()])];
    let extract = ["extract", &ply, "--labels", &object, "-o", &part.to_string_lossy()].map(str::to_owned);
    runs.push(("extract", extract.to_vec()));
    for (name, camera) in cameras(side, size) {
        let file = folder.path().join(format!("{name}.json"));
        let text = serde_json::to_string(&CameraFile::from(&camera)).map_err(|error| Error::Bug(error.to_string()))?;
        atomic::write(&file, |to| to.write_all(text.as_bytes()))?;
        let pictures = folder.path().join("pictures");
        let (camera, pictures) = (file.to_string_lossy(), pictures.to_string_lossy());
        let render = ["render", &ply, "--camera", &camera, "-o", &pictures, "--memory-limit", limit];
        let what = ["--what", "rgb,labels", "--format", "exr"];
        runs.push((name, render.into_iter().chain(what).map(str::to_owned).collect()));
    }
    println!("{count} Gaussians, {} MiB, pictures of {} x {} px with {limit}", length(&ply) >> 20, size.0, size.1);
    let mut rows = vec![["command", "s", "host, MiB"].map(str::to_owned).to_vec()];
    let mut found = Vec::new();
    for (name, args) in runs {
        let (seconds, peak) = measured(&args)?;
        let mebibytes = peak.map_or("-".to_owned(), |bytes| (bytes >> 20).to_string());
        rows.push(vec![name.to_owned(), format!("{seconds:.1}"), mebibytes]);
        found.push(json!({ "command": name, "seconds": seconds, "peak_host_bytes": peak }));
    }
    println!("{}", table(&rows));
    let found: Value = json!({ "schema_version": 1, "gaussians": count, "memory_limit": limit, "runs": found });
    write_json(&common.output.join("large.json"), &found)
}

fn length(path: &str) -> u64 {
    std::fs::metadata(path).map_or(0, |found| found.len())
}

/// Writes the blocks in order, with one label each.
fn write_city(path: &Path, count: usize, side: usize) -> Result<()> {
    let one = Gaussians {
        means: vec![[0.0; 3]],
        quats: vec![[1.0, 0.0, 0.0, 0.0]],
        scales: vec![[0.0; 3]],
        opacities: vec![0.0],
        sh0: vec![[0.0; 3]],
        sh_rest: vec![[0.0; 3]; 15],
        sh_degree: SH_DEGREE,
        labels: Some(vec![0]),
        ..Gaussians::default()
    };
    write_model(path, &one)?;
    let bytes = std::fs::read(path).map_err(Error::read(path))?;
    let rows = bytes.len() - 63 * 4;
    let header =
        String::from_utf8_lossy(&bytes[..rows]).replace("element vertex 1\n", &format!("element vertex {count}\n"));
    let mut random = SmallRng::seed_from_u64(3);
    atomic::write(path, |to| {
        let mut to = std::io::BufWriter::new(to);
        to.write_all(header.as_bytes())?;
        for row in 0..count {
            let block = row * side * side / count;
            let values = gaussian(&mut random, block, side);
            values.iter().try_for_each(|value| to.write_all(&value.to_le_bytes()))?;
        }
        to.flush()
    })
}

/// Returns the columns of a Gaussian on the ground, on a wall or on the roof of a block.
fn gaussian(random: &mut SmallRng, block: usize, side: usize) -> [f32; 63] {
    let mut draw = |low: f64, high: f64| random.random_range(low..high);
    let half = 0.35 * BLOCK_SIZE;
    let height = 8.0 + (block * 7 % 23) as f64;
    let place = match draw(0.0, 1.0) {
        kind if kind < 0.3 => DVec3::new(draw(-0.5, 0.5) * BLOCK_SIZE, 0.0, draw(-0.5, 0.5) * BLOCK_SIZE),
        kind if kind < 0.6 => DVec3::new(half * draw(-1.0, 1.0).signum(), -draw(0.0, height), draw(-half, half)),
        kind if kind < 0.9 => DVec3::new(draw(-half, half), -draw(0.0, height), half * draw(-1.0, 1.0).signum()),
        _ => DVec3::new(draw(-half, half), -height, draw(-half, half)),
    };
    let corner = DVec3::new((block % side) as f64 + 0.5, 0.0, (block / side) as f64 + 0.5) * BLOCK_SIZE;
    let mut values = [0.0; 63];
    values[..3].copy_from_slice(&(place + corner).as_vec3().to_array());
    values[6..9].copy_from_slice(&[0; 3].map(|_| draw(-1.0, 1.0) as f32));
    values[54] = draw(-1.0, 4.0) as f32;
    values[55..58].copy_from_slice(&[0; 3].map(|_| draw(0.02_f64.ln(), 0.2_f64.ln()) as f32));
    values[58..62].copy_from_slice(&[1.0, draw(-1.0, 1.0) as f32, draw(-1.0, 1.0) as f32, draw(-1.0, 1.0) as f32]);
    values[62] = (FIRST_LABEL + block) as f32;
    values
}

/// A view along a street, and one of the whole city from above.
fn cameras(side: usize, (width, height): (u32, u32)) -> [(&'static str, Camera); 2] {
    let focal = 0.6 * f64::from(width);
    let at = |eye: DVec3, target: DVec3| {
        let forward = (target - eye).normalize();
        let right = DVec3::Y.cross(forward).normalize();
        let rotation = DMat3::from_cols(right, forward.cross(right), forward).transpose();
        let (cx, cy) = (0.5 * f64::from(width), 0.5 * f64::from(height));
        Camera { rotation, translation: -(rotation * eye), fx: focal, fy: focal, cx, cy, width, height }
    };
    let all = side as f64 * BLOCK_SIZE;
    let street = DVec3::new(BLOCK_SIZE * (side / 2) as f64, -1.7, 0.45 * all);
    let above = DVec3::new(0.5 * all, -0.8 * all, -0.3 * all);
    [("street", at(street, street + DVec3::Z)), ("above", at(above, DVec3::new(0.5 * all, 0.0, 0.5 * all)))]
}

/// Runs the program. Returns its seconds, and its peak memory if the system reports it, bytes.
fn measured(args: &[String]) -> Result<(f64, Option<u64>)> {
    let failed = |what: String| Error::Bug(format!("labelgs {}: {what}", args[0]));
    let start = Instant::now();
    let mut program = Command::new(env!("CARGO_BIN_EXE_labelgs"));
    let program = program.args(args).arg("-q").stdin(Stdio::null()).stdout(Stdio::null()).spawn();
    let mut program = program.map_err(|error| failed(error.to_string()))?;
    let status = format!("/proc/{}/status", program.id());
    let mut peak = None;
    loop {
        let text = std::fs::read_to_string(&status).unwrap_or_default();
        let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        let kibibytes = line.and_then(|line| line.trim().trim_end_matches(" kB").parse::<u64>().ok());
        peak = peak.max(kibibytes.map(|count| count << 10));
        match program.try_wait().map_err(|error| failed(error.to_string()))? {
            Some(status) if status.success() => return Ok((start.elapsed().as_secs_f64(), peak)),
            Some(status) => return Err(failed(status.to_string())),
            None => std::thread::sleep(Duration::from_millis(20)),
        }
    }
}
