//! `labelgs ablate`: the same scene trained in several ways, in one table.

mod quoted;
mod rows;
mod table;

use super::args::JsonFlag;
use super::context::Context;
use super::eval::EvalArgs;
use super::train_args::TrainArgs;
use super::{eval, interrupt, stdout, train};
use crate::eval::scores::MeanScores;
use crate::{Error, Result};
use clap::{Args, FromArgMatches};
use rows::{Masks, Row, rows};
use serde::Serialize;
use serde_json::json;
use std::path::{Path, PathBuf};

/// `labelgs ablate`.
#[derive(Args, Clone, Debug)]
pub struct AblateArgs {
    /// Folder of the scene (COLMAP or transforms.json), or one .json file.
    #[arg(value_name = "SCENE")]
    pub scene: PathBuf,
    /// Folder of id masks, to train and to score with.
    #[arg(long, value_name = "DIR")]
    pub masks: PathBuf,
    /// Masks that were tracked on the photos alone, for the variant paper-no-dov.
    #[arg(long, value_name = "DIR")]
    pub masks_without_dov: Option<PathBuf>,
    /// Masks to score with, where those to train with are spoilt.
    #[arg(long, value_name = "DIR")]
    pub truth: Option<PathBuf>,
    /// Folder for the runs, VARIANT-SEED, and ablation.json.
    #[arg(short, long, value_name = "OUT")]
    pub output: PathBuf,
    /// Variants, with commas between: no-labels, paper, paper-no-dov, paper-no-gpf, paper-no-oam, paper-votes, ours,
    /// ours-no-oam; otherwise all.
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub rows: Vec<String>,
    /// A variant of one's own, NAME=FLAGS of `labelgs train`; may be given several times.
    #[arg(long = "row", value_name = "NAME=FLAGS")]
    pub own_rows: Vec<String>,
    /// Runs of each variant, with seeds 0, 1, ..
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..=100))]
    pub seeds: u64,
    /// JSON.
    #[command(flatten)]
    pub json: JsonFlag,
    /// Flags of `labelgs train` for all variants, after `--`.
    #[arg(last = true, value_name = "FLAGS")]
    pub common: Vec<String>,
}

/// One run.
#[derive(Clone, Debug, Serialize)]
struct Outcome {
    /// Seed.
    seed: u64,
    /// Scores of the test views.
    scores: MeanScores,
    /// Gaussians at the end.
    gaussians: u64,
    /// Time of the training without scoring, s.
    seconds: f64,
}

/// Runs all variants and prints the table.
pub fn run(args: &AblateArgs, context: &Context) -> Result<()> {
    let rows = rows(&args.rows, &args.own_rows, args.masks_without_dov.is_some())?;
    // A typing error in the last variant is found before the first is trained.
    for row in &rows {
        train_args(row, 0, args)?;
    }
    let mut outcomes: Vec<(Row, Vec<Outcome>)> = Vec::new();
    for row in rows {
        let mut runs = Vec::new();
        for seed in 0..args.seeds {
            tracing::info!("variant {}, seed {seed}", row.name);
            runs.push(one(&row, seed, args, context)?);
            if let Some(status) = interrupt::status() {
                return Err(Error::Interrupted(status));
            }
        }
        outcomes.push((row, runs));
    }
    let table: Vec<_> =
        outcomes.iter().map(|(row, runs)| json!({ "name": row.name, "flags": row.flags, "runs": runs })).collect();
    let record = json!({ "schema_version": 1, "scene": args.scene.display().to_string(), "rows": table });
    eval::write_json(&args.output.join("ablation.json"), &record)?;
    if context.json || args.json.json {
        return stdout::print_json(&record);
    }
    let rows: Vec<(&str, &[Outcome])> =
        outcomes.iter().map(|(row, runs)| (row.name.as_str(), runs.as_slice())).collect();
    stdout::print(&(table::table(&rows) + &quoted::table()))
}

fn folder(row: &Row, seed: u64, args: &AblateArgs) -> PathBuf {
    args.output.join(format!("{}-{seed}", row.name))
}

/// The `train` that a variant is, as if it had been typed.
fn train_args(row: &Row, seed: u64, args: &AblateArgs) -> Result<TrainArgs> {
    let text = |path: &Path| path.display().to_string();
    let mut typed = vec!["train".to_owned(), text(&args.scene)];
    typed.extend(["-o".to_owned(), text(&folder(row, seed, args)), "--seed".to_owned(), seed.to_string()]);
    let masks = match row.masks {
        Masks::None => None,
        Masks::Given => Some(&args.masks),
        Masks::WithoutDov => args.masks_without_dov.as_ref(),
    };
    if let Some(masks) = masks {
        typed.extend(["--masks".to_owned(), text(masks)]);
    }
    typed.extend(row.flags.iter().chain(&args.common).cloned());
    parse(typed).map_err(|error| {
        let text = error.to_string();
        Error::usage("--row", format!("{}: {}", row.name, text.lines().next().unwrap_or_default()))
    })
}

/// Arguments of a verb as if they had been typed; the first is its name.
fn parse<A: Args + FromArgMatches>(typed: Vec<String>) -> std::result::Result<A, clap::Error> {
    A::from_arg_matches(&A::augment_args(clap::Command::new("labelgs")).try_get_matches_from(typed)?)
}

fn one(row: &Row, seed: u64, args: &AblateArgs, context: &Context) -> Result<Outcome> {
    let train_args = train_args(row, seed, args)?;
    let config = super::config::decide(&train_args)?;
    let (summary, _) = train::train(&train_args, context)?;
    let text = |path: &Path| path.display().to_string();
    let out = folder(row, seed, args);
    let masks = args.truth.as_ref().unwrap_or(&args.masks);
    let mut typed = vec!["eval".to_owned(), text(&out)];
    typed.extend(["--scene".to_owned(), text(&args.scene), "--masks".to_owned(), text(masks)]);
    typed.extend(["--test-every".to_owned(), config.test_every.to_string()]);
    if config.max_resolution > 0 {
        typed.extend(["--max-resolution".to_owned(), config.max_resolution.to_string()]);
    }
    let colour: Vec<String> = config.background.iter().map(f32::to_string).collect();
    typed.extend(["--background".to_owned(), colour.join(",")]);
    let eval_args: EvalArgs = parse(typed).map_err(|error| Error::Bug(format!("eval: {error}")))?;
    let scores = eval::score(&eval_args, context)?;
    eval::write_json(&out.join("scores.json"), &scores)?;
    Ok(Outcome {
        seed,
        scores: scores.mean,
        gaussians: summary["gaussians"].as_u64().unwrap_or(0),
        seconds: summary["seconds"].as_f64().unwrap_or(0.0),
    })
}
