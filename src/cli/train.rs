//! `labelgs train`, also over losses of the device.

use super::context::Context;
use super::train_args::TrainArgs;
use super::train_run::train_once;
use super::{interrupt, stdout};
use crate::io::checkpoint_folder;
use crate::{Error, Result};
use std::time::Duration;

/// Trains a model and prints what came of it.
pub fn run(args: &TrainArgs, context: &Context) -> Result<()> {
    let (summary, sentence) = train(args, context)?;
    if context.json || args.json.json { stdout::print_json(&summary) } else { stdout::print(&sentence) }
}

/// Seconds between looks for a device after one was lost.
const WAITS: [u64; 3] = [1, 4, 16];

/// Trains a model; returns its metrics.json, and the same in a sentence. If `--restart` was typed, also over losses of
/// the device: one that is lost twice without a checkpoint in between would be lost again.
pub(super) fn train(args: &TrainArgs, context: &Context) -> Result<(serde_json::Value, String)> {
    if !args.restart {
        return train_once(args, context);
    }
    let newest = || Ok(checkpoint_folder::list(&args.output)?.first().map_or(0, |found| found.number));
    let mut args = args.clone();
    let (mut before, mut was_lost) = (newest()?, false);
    let mut waits = WAITS.iter();
    loop {
        let error = match train_once(&args, context) {
            Err(error @ Error::DeviceLost { .. }) => error,
            // A driver may take a while until it has a device again.
            Err(error) if was_lost && error.is_without_device() => {
                interrupt::check()?;
                let Some(&seconds) = waits.next() else { return Err(error) };
                tracing::warn!("{error}; tried again in {seconds} s");
                std::thread::sleep(Duration::from_secs(seconds));
                continue;
            }
            other => return other,
        };
        interrupt::check()?;
        waits = WAITS.iter();
        let number = newest()?;
        if number <= before {
            return Err(error);
        }
        tracing::warn!("{error}; it is opened again, and training goes on from the newest checkpoint");
        (before, was_lost, args.resume, args.config) = (number, true, true, None);
    }
}
