//! `labelgs train --network`: from photos alone to a labelled model.

use super::args::TrainArgs;
use super::trained;
use crate::cli::commands::masks::make::{self, MakeArgs};
use crate::cli::commands::masks::repair::{self, RepairArgs};
use crate::cli::support::{Context, ReadArgs, SceneArgs, open_gpu, signals};
use crate::files::run_folder::Lock;
use crate::run::labelling::{label, trained_masks};
use crate::run::{Request, Settings, Start, Summary};
use crate::{Error, Result};
use std::path::Path;

/// Folder of the run with the masks, and the folder there with those that agree.
const MASKS: &str = "masks";
const AGREED: &str = "agreed";

/// Trains without masks, makes masks, chooses objects among them, and labels the model.
pub(super) fn run(args: &TrainArgs, network: &Path, request: Request, context: &Context) -> Result<Summary> {
    let out = args.output.as_path();
    if let (Start::Newest(_), Some(masks)) = (&request.start, trained_masks(out)?) {
        let problem = format!("{} was trained with masks, {masks}, which label it; leave it out", out.display());
        return Err(Error::usage("--network", problem));
    }
    let make = MakeArgs::new(&args.scene, network, out.join(MASKS), args.how.files.clone());
    // What cannot be used fails before hours of training.
    make::opened(&make)?;
    tracing::info!("1 of 4: training without masks");
    let label_request = Request { inputs: request.inputs.clone(), ..Request::new(&args.scene, out) };
    let summary = trained(args, request, context)?;
    if summary.stopped {
        return Ok(summary);
    }
    // Nothing is lost from here on: what is there is used again.
    signals::end_at_once()?;
    let _lock = Lock::take(out)?;
    let poses = Settings::of_model(out)?.map(|settings| settings.read.poses);
    let read = ReadArgs { poses, ..make.read.clone() };
    tracing::info!("2 of 4: making masks");
    let (_, text) = make::make(&MakeArgs { read: read.clone(), ..make.clone() }, context)?;
    tracing::info!("{}", text.trim_end());
    tracing::info!("3 of 4: choosing objects");
    let agreed = make.output.join(AGREED);
    if agreed.is_dir() {
        std::fs::remove_dir_all(&agreed).map_err(Error::write(&agreed))?;
    }
    let reading = SceneArgs { ignore: args.how.ignore.clone(), read, ..SceneArgs::default() }.of_run(out)?;
    let repair = RepairArgs::new(&make.output, (out, &args.scene), agreed, reading);
    repair::repair(&repair, context)?;
    tracing::info!("4 of 4: labelling the model");
    label(&label_request, &repair.output, open_gpu(context)?, summary)
}
