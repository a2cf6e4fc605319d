//! Scores of real captures as papers report them: every eighth photo is held out, several seeds, PSNR, SSIM and LPIPS
//! of the clamped renders. With masks, the scores of labels too. Scores of other trainers stand beside them where
//! known.

use super::rows::{Plan, Rows};
use super::table::{Group, groups};
use super::{Common, scene_of};
use crate::measure::table;
use labelgs::{Error, Result};
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// Scores of other trainers on the same held-out views.
const OTHERS_CSV: &str = include_str!("../others.csv");

/// Options of the comparison.
#[derive(clap::Args, Clone, Debug)]
pub struct Options {
    #[command(flatten)]
    common: Common,
    /// Captures: FOLDER@PX, with the longest side of a photo; with +MASKS, the name of a folder in the capture, the
    /// training has labels.
    #[arg(value_name = "CAPTURE", required = true)]
    captures: Vec<String>,
    /// Seeds, each a training.
    #[arg(long, value_name = "SEED,SEED", value_delimiter = ',', default_values_t = [0, 1, 2])]
    seeds: Vec<u64>,
    /// Steps of a training.
    #[arg(long, value_name = "N,N", value_delimiter = ',', default_values_t = [3000])]
    lengths: Vec<u32>,
    /// Weights of LPIPS, as `tools/bench/lpips.py weights` writes them.
    #[arg(long, value_name = "FILE")]
    lpips: Option<PathBuf>,
    /// Further flags of `labelgs train`, such as "--masked-only".
    #[arg(long, value_name = "FLAGS", default_value = "", allow_hyphen_values = true)]
    flags: String,
}

/// A row of [`OTHERS_CSV`].
#[derive(Debug, Deserialize)]
struct Other {
    trainer: String,
    capture: String,
    longest_side_px: u32,
    steps: u32,
    psnr: f64,
    ssim: f64,
}

/// Runs it.
pub fn run(options: &Options) -> Result<()> {
    let own = PathBuf::from(env!("CARGO_BIN_EXE_labelgs"));
    let made = tempfile::tempdir().map_err(Error::write("a folder for scenes"))?;
    let flags: Vec<String> = options.flags.split_whitespace().map(str::to_owned).collect();
    let lengths = if options.common.small { vec![20] } else { options.lengths.clone() };
    let mut rows = Rows::open(&options.common.output.join("real.jsonl"))?;
    let mut found = Vec::new();
    for capture in &options.captures {
        let scene = scene_of(capture, made.path(), options.common.small)?;
        for &steps in &lengths {
            for &seed in &options.seeds {
                let (scene, flags, lpips) = (&scene, flags.as_slice(), options.lpips.as_deref());
                let row = rows.row(&Plan { name: "labelgs", program: &own, flags, scene, seed, steps, lpips }, &own)?;
                println!("{}, {steps} steps, seed {seed}: {:.2} dB, {:.0} CPU s", row.scene, row.psnr, row.cpu);
                found.push(row);
            }
        }
    }
    let others = csv::Reader::from_reader(OTHERS_CSV.as_bytes()).deserialize().collect::<Result<Vec<Other>, _>>();
    let others = others.map_err(|error| Error::data(Path::new("tools/bench/others.csv"), "", error.to_string()))?;
    let mut cells = vec![head()];
    for group in &groups(&found) {
        cells.push(own_cells(group));
        cells.extend(others.iter().filter(|other| other.is_beside(group)).map(other_cells));
    }
    println!("\n{}", table(&cells));
    println!("Means over {} seeds, with their range; on {}.", options.seeds.len(), devices(&found));
    Ok(())
}

fn devices(rows: &[super::rows::Row]) -> String {
    let mut devices: Vec<&str> = rows.iter().map(|row| row.device.as_str()).collect();
    devices.sort_unstable();
    devices.dedup();
    devices.join(", ")
}

fn head() -> Vec<String> {
    let head = "capture, trainer, steps, PSNR, SSIM, LPIPS, Gaussians, CPU s, s, IoU map, IoU object, boundary IoU";
    head.split(", ").map(str::to_owned).collect()
}

fn own_cells(group: &Group) -> Vec<String> {
    vec![
        group.scene.to_owned(),
        "labelgs".to_owned(),
        group.steps.to_string(),
        group.cell(2, |row| Some(row.psnr)),
        group.cell(3, |row| Some(row.ssim)),
        group.cell(3, |row| row.lpips),
        group.cell(0, |row| Some(row.gaussians as f64)),
        group.cell(0, |row| Some(row.cpu)),
        group.cell(0, |row| Some(row.seconds)),
        group.cell(3, |row| row.iou_map),
        group.cell(3, |row| row.iou_object),
        group.cell(3, |row| row.boundary_iou),
    ]
}

fn other_cells(other: &Other) -> Vec<String> {
    let known = [
        other.capture.clone(),
        other.trainer.clone(),
        other.steps.to_string(),
        format!("{:.2}", other.psnr),
        format!("{:.3}", other.ssim),
    ];
    known.into_iter().chain(std::iter::repeat_n("-".to_owned(), head().len() - 5)).collect()
}

impl Other {
    /// Returns true if it was trained on the same photos for as many steps.
    fn is_beside(&self, group: &Group) -> bool {
        let name = group.scene.split('+').next().unwrap_or_default();
        name == format!("{}@{}", self.capture, self.longest_side_px) && group.steps == self.steps
    }
}
