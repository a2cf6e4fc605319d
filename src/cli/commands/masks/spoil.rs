//! `labelgs masks spoil`.

use super::{pngs, write_mask};
use crate::cli::support::Context;
use crate::files::atomic;
use crate::masks::mask::read_mask;
use crate::scene::LabelMap;
use crate::synth::spoil::{Fault, spoil};
use crate::{Error, Result};
use clap::Args;
use serde_json::json;
use std::path::PathBuf;

/// `labelgs masks spoil`.
#[derive(Args, Clone, Debug)]
pub struct SpoilArgs {
    /// Folder of correct id masks.
    #[arg(value_name = "MASKS")]
    pub masks: PathBuf,
    /// Folder to write; must be new or empty.
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Type of fault.
    #[arg(long, value_name = "FAULT", value_enum)]
    pub fault: Fault,
    /// Share of views to change.
    #[arg(long, value_name = "SHARE", default_value_t = 0.1)]
    pub share: f64,
    /// Random seed for the choice of views.
    #[arg(long, value_name = "SEED", default_value_t = 0)]
    pub seed: u64,
}

/// Writes masks with deliberate faults.
pub(crate) fn run(args: &SpoilArgs, context: &Context) -> Result<()> {
    if !(0.0..=1.0).contains(&args.share) {
        return Err(Error::usage("--share", format!("is {}, needs 0 to 1", args.share)));
    }
    atomic::require_empty("--output", &args.output)?;
    let names = pngs(&args.masks)?;
    let masks: Vec<LabelMap> = names.iter().map(|name| read_mask(args.masks.join(name))).collect::<Result<_>>()?;
    let spoilt = spoil(&masks, args.fault, args.share, args.seed);
    let mut changed = 0;
    for ((name, before), after) in names.iter().zip(&masks).zip(&spoilt) {
        changed += u32::from(after.as_ref() != Some(before));
        if let Some(mask) = after {
            write_mask(&args.output.join(name), mask)?;
        }
    }
    let text = format!("{}: {changed} of {} masks changed\n", args.output.display(), names.len());
    context.show(&json!({ "schema_version": 1, "masks": names.len(), "changed": changed }), &text)
}
