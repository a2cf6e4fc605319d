//! `labelgs clean`.

use crate::Result;
use crate::cli::support::parsers::{corners, distance, share};
use crate::cli::support::{Context, EditArgs, EditResult};
use crate::edit::clean::{Cleaning, clean};
use clap::Args;
use glam::DVec3;
use serde_json::json;

/// `labelgs clean`.
#[derive(Args, Clone, Debug)]
#[command(group(clap::ArgGroup::new("rule").required(true).multiple(true)
    .args(["min_opacity", "max_size", "max_gap", "inside"])))]
pub struct CleanArgs {
    #[command(flatten)]
    pub edit: EditArgs,
    /// Remove Gaussians with a lower opacity, 0 to 1.
    #[arg(long, value_name = "SHARE", value_parser = share)]
    pub min_opacity: Option<f32>,
    /// Remove Gaussians with a larger standard deviation along any axis, world units.
    #[arg(long, value_name = "SIZE", value_parser = distance)]
    pub max_size: Option<f64>,
    /// Remove isolated Gaussians: the distance to their eighth neighbour exceeds FACTOR times the median distance.
    #[arg(long, value_name = "FACTOR", value_parser = distance)]
    pub max_gap: Option<f64>,
    /// Remove Gaussians with a centre outside of this box, world units.
    #[arg(long, value_name = "x0,y0,z0,x1,y1,z1", value_parser = corners, allow_hyphen_values = true)]
    pub inside: Option<[DVec3; 2]>,
}

/// Writes the model without floaters.
pub(crate) fn run(args: &CleanArgs, context: &Context) -> Result<()> {
    let (model, known) = args.edit.open()?;
    let CleanArgs { min_opacity, max_size, max_gap, inside, .. } = *args;
    let (cleaned, dropped) = clean(&model, &Cleaning { min_opacity, max_size, max_gap, inside })?;
    tracing::info!(
        "removed {} faint, {} huge, {} outside and {} isolated Gaussians",
        dropped.faint,
        dropped.huge,
        dropped.outside,
        dropped.lonely
    );
    args.edit.finish(context, &EditResult::with_labels_of(&cleaned, known, model.len()), json!({ "dropped": dropped }))
}
