//! `labelgs train --network`: from photos alone to a labelled model.

use super::args::TrainArgs;
use super::trained;
use crate::cli::commands::masks::make::{self, MakeArgs};
use crate::cli::commands::masks::repair::{self, RepairArgs};
use crate::cli::support::{Context, ReadArgs, SceneArgs, signals};
use crate::files::run_folder::Lock;
use crate::records::checkpoint_folder;
use crate::run::{Request, Settings, Summary};
use crate::{Error, Result};
use std::path::{Path, PathBuf};

/// Subfolders of the run: the run without masks, the masks, and inside them the masks with matching ids.
const PLAIN_FOLDER: &str = "plain";
const MASKS_FOLDER: &str = "masks";
const AGREED_FOLDER: &str = "agreed";
/// Steps without masks for each one with them.
const PLAIN_STEPS: u32 = 3;

/// Trains without masks, makes masks, chooses objects among them, and trains the model on with these.
pub(super) fn run(args: &TrainArgs, network: &Path, context: &Context) -> Result<Summary> {
    let out = args.output.as_path();
    let (plain, agreed) = (out.join(PLAIN_FOLDER), out.join(MASKS_FOLDER).join(AGREED_FOLDER));
    let typed = args.how.settings(None)?;
    let is_last = args.how.resume && agreed.is_dir() && !checkpoint_folder::list(out)?.is_empty();
    if !is_last {
        std::fs::create_dir_all(out).map_err(Error::write(out))?;
        let _lock = Lock::take(out)?;
        let stopped = masks(args, network, (&plain, &agreed), context)?;
        if let Some(summary) = stopped {
            return Ok(summary);
        }
    }
    tracing::info!("4 of 4: training with masks");
    let settings = |checkpoint: Option<&Settings>| {
        let mut settings = args.how.settings(checkpoint)?;
        settings.train.iterations = typed.train.iterations.div_ceil(PLAIN_STEPS);
        Ok(settings)
    };
    let request = args.how.request((&args.scene, out), Some(agreed), &settings)?;
    trained(args, Request { init: Some(plain), ..request }, context)
}

/// Trains without masks and makes masks with matching ids. Returns the result of the training if it was stopped.
fn masks(
    args: &TrainArgs,
    network: &Path,
    (plain, agreed): (&Path, &PathBuf),
    context: &Context,
) -> Result<Option<Summary>> {
    let make = MakeArgs::new(&args.scene, network, args.output.join(MASKS_FOLDER), args.how.files.clone());
    // An unusable network fails here, before hours of training.
    make::opened(&make)?;
    // After a kill, masks of an earlier run would be mistaken for masks of this run.
    if agreed.is_dir() {
        std::fs::remove_dir_all(agreed).map_err(Error::write(agreed))?;
    }
    tracing::info!("1 of 4: training without masks");
    let settings = |checkpoint: Option<&Settings>| args.how.settings(checkpoint);
    let summary = trained(args, args.how.request((&args.scene, plain), None, &settings)?, context)?;
    if summary.stopped {
        return Ok(Some(summary));
    }
    // From here, a signal loses nothing: existing files are used again.
    signals::end_at_once()?;
    let poses = Settings::for_model(plain)?.map(|settings| settings.read.poses);
    let read = ReadArgs { poses, ..make.read.clone() };
    tracing::info!("2 of 4: making masks");
    let (_, text) = make::make(&MakeArgs { read: read.clone(), ..make.clone() }, context)?;
    tracing::info!("{}", text.trim_end());
    tracing::info!("3 of 4: choosing objects");
    let reading = SceneArgs { ignore: args.how.ignore.clone(), read, ..SceneArgs::default() }.of_run(plain)?;
    repair::repair(&RepairArgs::new(&make.output, (plain, &args.scene), agreed.clone(), reading), context)?;
    Ok(None)
}
