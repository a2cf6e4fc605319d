//! Quality against CPU time: this program with several run lengths and settings, and another program if given, such as
//! an earlier revision.
//!
//! All train the same scenes from the same seeds in separate processes, one after another. All scores come from this
//! program. Each run length is a separate training, because schedules are fractions of the run.

pub mod real;
mod rows;
mod table;

use super::Common;
use super::measure::table;
use labelgs::synth::{self, Preset, SynthOptions};
use labelgs::{Error, Result};
use rows::{Plan, Row, Rows, TrainingScene};
use std::path::{Path, PathBuf};

/// Name of the other program in tables.
const OTHER_NAME: &str = "other";
/// Name of this program without further flags.
const OWN_NAME: &str = "this";

/// Options of the comparison.
#[derive(clap::Args, Clone, Debug)]
pub struct Options {
    #[command(flatten)]
    common: Common,
    /// Seeds; each is a training of every kind and length.
    #[arg(long, value_name = "SEED,SEED", value_delimiter = ',', default_values_t = [0, 1, 2])]
    seeds: Vec<u64>,
    /// Another labelgs program to compare with, such as an earlier revision.
    #[arg(long, value_name = "PROGRAM")]
    against: Option<PathBuf>,
    /// Scenes: plain, hard (built in), or FOLDER@PX with the longest side of a photo; with +MASKS, the name of a
    /// folder in the scene, the training has labels.
    #[arg(long, value_name = "SCENE,SCENE", value_delimiter = ',', default_values_t = ["plain".to_owned()])]
    scenes: Vec<String>,
    /// Steps of the trainings of this program.
    #[arg(long, value_name = "N,N", value_delimiter = ',', default_values_t = [750, 1500, 3000])]
    lengths: Vec<u32>,
    /// Steps of the other program.
    #[arg(long, value_name = "N,N", value_delimiter = ',', default_values_t = [3000])]
    against_lengths: Vec<u32>,
    /// Another kind of training of this program: its name, and its flags after an equals sign. May be repeated.
    #[arg(long = "kind", value_name = "NAME=FLAGS")]
    kinds: Vec<String>,
}

/// A kind of training.
struct Kind {
    name: String,
    program: PathBuf,
    flags: Vec<String>,
    lengths: Vec<u32>,
}

/// Runs the benchmark.
pub fn run(options: &Options) -> Result<()> {
    let common = &options.common;
    let own = PathBuf::from(env!("CARGO_BIN_EXE_labelgs"));
    let (lengths, against) = match common.small {
        true => (vec![20, 40], vec![30]),
        false => (options.lengths.clone(), options.against_lengths.clone()),
    };
    let kind = |name: &str, flags: &str, program: &Path, lengths: &[u32]| Kind {
        name: name.to_owned(),
        program: program.to_owned(),
        flags: flags.split_whitespace().map(str::to_owned).collect(),
        lengths: lengths.to_vec(),
    };
    let mut kinds: Vec<Kind> = options.against.iter().map(|other| kind(OTHER_NAME, "", other, &against)).collect();
    kinds.push(kind(OWN_NAME, "", &own, &lengths));
    for text in &options.kinds {
        let (name, flags) = text.split_once('=').unwrap_or((text, ""));
        kinds.push(kind(name, flags, &own, &lengths));
    }
    let made = tempfile::tempdir().map_err(Error::write("a folder for scenes"))?;
    let scenes =
        options.scenes.iter().map(|text| scene_of(text, made.path(), common.small)).collect::<Result<Vec<_>>>()?;
    let mut rows = Rows::open(&common.output.join("against.jsonl"))?;
    let mut found = Vec::new();
    for scene in &scenes {
        for &seed in &options.seeds {
            for kind in &kinds {
                for &steps in &kind.lengths {
                    let (name, flags) = (kind.name.as_str(), kind.flags.as_slice());
                    let row =
                        rows.row(&Plan { name, program: &kind.program, flags, scene, seed, steps, lpips: None }, &own)?;
                    println!("{}", line(&row));
                    found.push(row);
                }
            }
        }
    }
    println!("\n{}", table(&table::rows_of(&found, OTHER_NAME)));
    Ok(())
}

fn line(row: &Row) -> String {
    let number = |value: Option<f64>| value.unwrap_or(f64::NAN);
    format!(
        "{} {} steps, {}, seed {}: {:.1} CPU s, {} Gaussians, PSNR {:.2} ({:.2} corrected), seen {:.2} ({:.2} corrected), \
         worst {:.2}",
        row.program,
        row.steps,
        row.scene,
        row.seed,
        row.cpu,
        row.gaussians,
        row.psnr,
        number(row.psnr_corrected),
        number(row.psnr_seen),
        number(row.psnr_seen_corrected),
        row.worst
    )
}

/// Parses a scene; writes a built-in one to `folder`.
fn scene_of(text: &str, folder: &Path, small: bool) -> Result<TrainingScene> {
    let (place, masks) = text.split_once('+').map_or((text, None), |(place, masks)| (place, Some(masks)));
    let (place, size) = place.split_once('@').map_or((place, "0"), |(place, size)| (place, size));
    let max_resolution =
        size.parse().map_err(|_| Error::usage("scenes", format!("`{size}` is not a number of pixels")))?;
    let preset = match place {
        "plain" => Some(Preset::Default),
        "hard" => Some(Preset::Hard),
        _ => None,
    };
    let path = match preset {
        Some(preset) => {
            let path = folder.join(text);
            let options = SynthOptions { preset, ..SynthOptions::default() };
            let tiny = SynthOptions { width: 64, height: 48, views: 9, points: 300, ..options };
            synth::write(&if small { tiny } else { options }, &path, &|_| Ok(()))?;
            path
        }
        None => PathBuf::from(place),
    };
    let name = match preset {
        Some(_) => text.to_owned(),
        None => {
            let stem = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
            format!("{stem}@{size}{}", masks.map_or(String::new(), |masks| format!("+{masks}")))
        }
    };
    Ok(TrainingScene { name, masks: masks.map(|masks| path.join(masks)), path, max_resolution })
}
