//! `labelgs ablate`: the same scene trained in several ways, in one table.

mod quoted;
mod rows;
mod table;

use crate::cli::commands::eval::{self, EvalArgs};
use crate::cli::commands::train;
use crate::cli::commands::train::args::TrainFlags;
use crate::cli::support::{Context, signals};
use crate::eval::scores::{MeanScores, Scores};
use crate::files::atomic;
use crate::run::{Settings, report};
use crate::{Error, Result};
use clap::{Args, FromArgMatches};
use rows::{Masks, Row, rows};
use serde::Serialize;
use serde_json::json;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// `labelgs ablate`.
#[derive(Args, Clone, Debug)]
pub struct AblateArgs {
    /// Scene: a folder (COLMAP, transforms.json, poses_bounds.npy, Metashape) or a .json, .npy or .xml file.
    #[arg(value_name = "SCENE")]
    pub scene: PathBuf,
    /// Folder of id masks for training and scoring.
    #[arg(long, value_name = "DIR")]
    pub masks: PathBuf,
    /// Folder of masks tracked on the photos only, for the variant paper-no-dov.
    #[arg(long, value_name = "DIR")]
    pub masks_without_dov: Option<PathBuf>,
    /// Folder of masks for scoring. Default: --masks.
    #[arg(long, value_name = "DIR")]
    pub truth: Option<PathBuf>,
    /// Folder for ablation.json, report.html and a run VARIANT-SEED for each training.
    #[arg(short, long, value_name = "OUT")]
    pub output: PathBuf,
    /// Comma-separated variants: no-labels, paper, paper-no-dov, paper-no-gpf, paper-no-oam, paper-votes, ours,
    /// ours-no-oam. Default: all.
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub rows: Vec<String>,
    /// Add a variant: NAME=FLAGS, with flags of `labelgs train`. Repeatable.
    #[arg(long = "row", value_name = "NAME=FLAGS")]
    pub own_rows: Vec<String>,
    /// Number of runs per variant, with seeds 0, 1, ...
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..=100))]
    pub seeds: u64,
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
    gaussians: u32,
    /// Time of the training without scoring, s.
    seconds: f64,
}

/// Runs all variants and prints the table.
pub(crate) fn run(args: &AblateArgs, context: &Context) -> Result<()> {
    let rows = rows(&args.rows, &args.own_rows, args.masks_without_dov.is_some())?;
    // A wrong flag of any variant is found before the first training.
    for row in &rows {
        flags(row, args)?;
    }
    let mut outcomes: Vec<(Row, Vec<Outcome>)> = Vec::new();
    for row in rows {
        let mut runs = Vec::new();
        for seed in 0..args.seeds {
            tracing::info!("variant {}, seed {seed}", row.name);
            runs.push(one(&row, seed, args, context)?);
            signals::check()?;
        }
        outcomes.push((row, runs));
    }
    let table: Vec<_> =
        outcomes.iter().map(|(row, runs)| json!({ "name": row.name, "flags": row.flags, "runs": runs })).collect();
    let record = json!({ "schema_version": 1, "scene": args.scene.display().to_string(), "rows": table });
    atomic::write_json(&args.output.join("ablation.json"), &record)?;
    let rows: Vec<(&str, &[Outcome])> =
        outcomes.iter().map(|(row, runs)| (row.name.as_str(), runs.as_slice())).collect();
    let text = table::table(&rows) + &quoted::table();
    let folders: Vec<PathBuf> =
        outcomes.iter().flat_map(|(row, runs)| runs.iter().map(|run| folder(args, row, run.seed))).collect();
    let page = report::write_with(&folders, &args.output.join(report::REPORT_FILE), &text)?;
    tracing::info!("report: {}", page.display());
    context.show(&record, &text)
}

/// Returns the folder of a run.
fn folder(args: &AblateArgs, row: &Row, seed: u64) -> PathBuf {
    args.output.join(format!("{}-{seed}", row.name))
}

/// Parses the flags of a variant.
fn flags(row: &Row, args: &AblateArgs) -> Result<TrainFlags> {
    let typed = std::iter::once("train").chain(row.flags.iter().chain(&args.common).map(String::as_str));
    let command = TrainFlags::augment_args(clap::Command::new("labelgs"));
    let flags = command.try_get_matches_from(typed).and_then(|matches| TrainFlags::from_arg_matches(&matches));
    let wrong = |problem: &str| Error::usage("--row", format!("{}: {problem}", row.name));
    let flags = flags.map_err(|error| wrong(error.to_string().lines().next().unwrap_or_default()))?;
    if flags.is_typed("seed") {
        return Err(wrong("the runs of a variant differ in --seed; use --seeds N instead"));
    }
    flags.settings(None).map_err(|error| wrong(&error.to_string()))?;
    Ok(flags)
}

fn one(row: &Row, seed: u64, args: &AblateArgs, context: &Context) -> Result<Outcome> {
    let flags = flags(row, args)?;
    let masks = match row.masks {
        Masks::None => None,
        Masks::Given => Some(args.masks.clone()),
        Masks::WithoutDov => args.masks_without_dov.clone(),
    };
    let out = folder(args, row, seed);
    let settings = |checkpoint: Option<&Settings>| {
        let mut settings = flags.settings(checkpoint)?;
        settings.train.seed = seed;
        Ok(settings)
    };
    let request = flags.request((&args.scene, &out), masks, &settings)?;
    let summary = train::train(request, context)?;
    let scores = score(&out, &settings(None)?, args, context)?;
    atomic::write_json(&out.join("scores.json"), &scores)?;
    Ok(Outcome { seed, scores: scores.mean, gaussians: summary.gaussians, seconds: summary.seconds })
}

/// Scores the model of a variant on its test views.
fn score(out: &Path, settings: &Settings, args: &AblateArgs, context: &Context) -> Result<Scores> {
    let flag = |name: &str, path: &Path| {
        let mut typed = OsString::from(name);
        typed.push(path);
        typed
    };
    let masks = flag("--masks=", args.truth.as_ref().unwrap_or(&args.masks));
    let typed = ["eval".into(), flag("--scene=", &args.scene), masks, "--".into(), out.into()];
    let parsed = EvalArgs::augment_args(clap::Command::new("labelgs")).try_get_matches_from(typed);
    let eval = parsed.and_then(|words| EvalArgs::from_arg_matches(&words));
    let eval = eval.map_err(|error| Error::Bug(format!("flags of eval: {error}")))?;
    eval::score(&EvalArgs { background: settings.train.background, ..eval }, context)
}
