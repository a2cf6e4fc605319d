//! Trainings as users run them: a program in a separate process, with its CPU time and the scores of its model. Rows
//! are stored in a file; existing rows are not measured again.

use labelgs::{Error, Result};
use nix::sys::resource::{UsageWho, getrusage};
use nix::sys::time::TimeValLike as _;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A scene to train on.
#[derive(Clone, Debug)]
pub struct TrainingScene {
    /// Name in the table.
    pub name: String,
    /// Folder.
    pub path: PathBuf,
    /// Longest side of a photo, px; 0 keeps all sizes.
    pub max_resolution: u32,
    /// Folder of masks, for a training with labels.
    pub masks: Option<PathBuf>,
}

/// One training.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Name of the program and its settings.
    pub program: String,
    /// CRC-32 of the program's file.
    pub build: u32,
    /// Flags other than scene, seed and steps.
    pub flags: Vec<String>,
    /// Scene.
    pub scene: String,
    /// Seed.
    pub seed: u64,
    /// Steps.
    pub steps: u32,
    /// CPU time of the whole process: reading, training, scoring the held-out views once; s.
    pub cpu: f64,
    /// Gaussians.
    pub gaussians: u64,
    /// Mean PSNR of the held-out views, dB.
    pub psnr: f64,
    /// The same after a colour correction per view; rows of earlier programs do not have it.
    pub psnr_corrected: Option<f64>,
    /// PSNR over pixels that three training views see.
    pub psnr_seen: Option<f64>,
    /// The same after a correction of these pixels.
    pub psnr_seen_corrected: Option<f64>,
    /// PSNR over the other pixels.
    pub psnr_unseen: Option<f64>,
    /// Share of the pixels that three training views see.
    pub seen_share: f64,
    /// PSNR of the worst view, dB.
    pub worst: f64,
    /// Mean SSIM.
    pub ssim: f64,
    /// Mean IoU of the label map.
    pub iou_map: Option<f64>,
    /// Mean IoU of isolated objects.
    pub iou_object: Option<f64>,
    /// Mean IoU of the boundaries of the label map.
    #[serde(default)]
    pub boundary_iou: Option<f64>,
    /// Mean LPIPS of the held-out views, where weights were given.
    #[serde(default)]
    pub lpips: Option<f64>,
    /// Duration of the training by a clock, s.
    #[serde(default)]
    pub seconds: f64,
    /// Device, as the run names it.
    #[serde(default)]
    pub device: String,
}

/// A training to run.
#[derive(Clone, Debug)]
pub struct Plan<'a> {
    /// Name in the table.
    pub name: &'a str,
    /// Program.
    pub program: &'a Path,
    /// Further flags.
    pub flags: &'a [String],
    /// Scene.
    pub scene: &'a TrainingScene,
    /// Seed.
    pub seed: u64,
    /// Steps.
    pub steps: u32,
    /// Weights of LPIPS, for scores that have it.
    pub lpips: Option<&'a Path>,
}

/// Rows of a file; each new row is stored at once.
#[derive(Debug)]
pub struct Rows {
    path: PathBuf,
    /// All rows.
    pub rows: Vec<Row>,
}

impl Rows {
    /// Reads the file, if it exists.
    pub fn open(path: &Path) -> Result<Self> {
        let text = if path.is_file() { fs::read_to_string(path).map_err(Error::read(path))? } else { String::new() };
        let row = |(number, line): (usize, &str)| {
            serde_json::from_str(line)
                .map_err(|error| Error::data(path, format!("line {}", number + 1), format!("{error}; delete the line")))
        };
        let rows = text.lines().enumerate().map(row).collect::<Result<_>>()?;
        Ok(Self { path: path.to_owned(), rows })
    }

    /// Returns the row of a plan; trains and scores if it is missing. `judge` is the program that scores.
    pub fn row(&mut self, plan: &Plan, judge: &Path) -> Result<Row> {
        let build = crc32fast::hash(&fs::read(plan.program).map_err(Error::read(plan.program))?);
        let is_it = |row: &&Row| {
            (row.build, row.seed, row.steps) == (build, plan.seed, plan.steps)
                && (&row.scene, row.flags.as_slice()) == (&plan.scene.name, plan.flags)
                && (plan.lpips.is_none() || row.lpips.is_some())
        };
        if let Some(row) = self.rows.iter().find(is_it) {
            return Ok(Row { program: plan.name.to_owned(), ..row.clone() });
        }
        let row = measure(plan, build, judge)?;
        let line = serde_json::to_string(&row).map_err(|error| Error::Bug(format!("JSON: {error}")))?;
        if let Some(folder) = self.path.parent() {
            fs::create_dir_all(folder).map_err(Error::write(folder))?;
        }
        let file = fs::OpenOptions::new().create(true).append(true).open(&self.path);
        file.and_then(|mut file| writeln!(file, "{line}")).map_err(Error::write(&self.path))?;
        self.rows.push(row.clone());
        Ok(row)
    }
}

/// Returns the CPU time of all finished child processes, s.
fn children() -> Result<f64> {
    let used = getrusage(UsageWho::RUSAGE_CHILDREN).map_err(|error| Error::Bug(format!("getrusage: {error}")))?;
    Ok((used.user_time().num_microseconds() + used.system_time().num_microseconds()) as f64 * 1e-6)
}

/// Runs a program and returns its output.
pub fn program(program: &Path, args: &[&str]) -> Result<String> {
    let output = Command::new(program).args(args).output().map_err(Error::read(program))?;
    if !output.status.success() {
        let problem = String::from_utf8_lossy(&output.stderr);
        return Err(Error::Check(format!("{} {}: {problem}", program.display(), args.join(" "))));
    }
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

fn measure(plan: &Plan, build: u32, judge: &Path) -> Result<Row> {
    let folder = tempfile::tempdir().map_err(Error::write("a folder for a run"))?;
    let text = |path: &Path| path.to_string_lossy().into_owned();
    let (scene, out) = (text(&plan.scene.path), text(&folder.path().join("run")));
    let (seed, steps, size) = (plan.seed.to_string(), plan.steps.to_string(), plan.scene.max_resolution.to_string());
    let masks = plan.scene.masks.as_deref().map(text);
    let mut args = vec!["train", &scene, "-o", &out, "--quiet", "--json", "--set", "preview_every=0"];
    args.extend(["--checkpoint-every", "0", "--max-resolution", &size, "--seed", &seed, "--iterations", &steps]);
    args.extend(masks.iter().flat_map(|masks| ["--masks", masks.as_str()]));
    args.extend(plan.flags.iter().map(String::as_str));
    let before = children()?;
    let summary: Value = parse(&program(plan.program, &args)?)?;
    let cpu = children()? - before;
    let mut args = vec!["eval", &out, "--scene", &scene, "--quiet", "--json"];
    args.extend(masks.iter().flat_map(|masks| ["--masks", masks.as_str()]));
    let lpips = plan.lpips.map(text);
    args.extend(lpips.iter().flat_map(|weights| ["--lpips", weights.as_str()]));
    let record = folder.path().join("run").join("run.json");
    // Programs of earlier revisions write none.
    let record = if record.is_file() {
        parse(&fs::read_to_string(&record).map_err(Error::read(&record))?)?
    } else {
        Value::Null
    };
    let scores = parse(&program(judge, &args)?)?;
    let mean = |key: &str| scores["mean"][key].as_f64();
    let needed = |found: Option<f64>, key: &str| found.ok_or_else(|| Error::Check(format!("eval gives no {key}")));
    let worst = scores["views"].as_object().into_iter().flatten().filter_map(|(_, view)| view["psnr"].as_f64());
    Ok(Row {
        program: plan.name.to_owned(),
        build,
        flags: plan.flags.to_vec(),
        scene: plan.scene.name.clone(),
        seed: plan.seed,
        steps: plan.steps,
        cpu,
        gaussians: summary["gaussians"].as_u64().unwrap_or(0),
        psnr: needed(mean("psnr"), "psnr")?,
        psnr_corrected: mean("psnr_corrected"),
        psnr_seen: mean("psnr_seen"),
        psnr_seen_corrected: mean("psnr_seen_corrected"),
        psnr_unseen: mean("psnr_unseen"),
        seen_share: needed(mean("seen_share"), "seen_share")?,
        worst: worst.fold(f64::INFINITY, f64::min),
        ssim: needed(mean("ssim"), "ssim")?,
        iou_map: mean("iou_map"),
        iou_object: mean("iou_object"),
        boundary_iou: mean("boundary_iou"),
        lpips: mean("lpips"),
        seconds: summary["seconds"].as_f64().unwrap_or(0.0),
        device: record["parts"][0]["device"].as_str().unwrap_or_default().to_owned(),
    })
}

fn parse(text: &str) -> Result<Value> {
    serde_json::from_str(text).map_err(|error| Error::Check(format!("a program printed no JSON: {error}")))
}
