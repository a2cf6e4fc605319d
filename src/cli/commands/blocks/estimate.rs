//! `labelgs blocks estimate`.

use crate::Result;
use crate::blocks::{Estimate, PlannedScene, estimate};
use crate::cli::support::Context;
use crate::cli::support::parsers::{Size, bytes, count, size};
use crate::words::counted;
use clap::Args;
use serde_json::json;

const MIB_BYTES: u64 = 1 << 20;

/// `labelgs blocks estimate`.
#[derive(Args, Clone, Debug)]
pub struct EstimateArgs {
    /// Gaussians of the whole scene, such as 100M.
    #[arg(long, value_name = "N", value_parser = count)]
    pub gaussians: u64,
    /// Gaussians of the coarse model. Default: a quarter of --gaussians.
    #[arg(long, value_name = "N", value_parser = count)]
    pub coarse: Option<u64>,
    /// Number of photos.
    #[arg(long, value_name = "N")]
    pub views: u64,
    /// Size of a photo, px.
    #[arg(long, value_name = "WxH", value_parser = size, default_value = "1600x1064")]
    pub size: Size,
    /// GPU memory, such as 24G.
    #[arg(long, alias = "gpu-memory", value_name = "SIZE", value_parser = bytes)]
    pub card: u64,
    /// Largest label id in the masks; 0 for a scene without masks.
    #[arg(long, value_name = "ID", default_value_t = 255)]
    pub labels: u32,
    /// Steps for a block of up to 300 views; larger blocks get proportionally more.
    #[arg(long, value_name = "N", default_value_t = 30_000, value_parser = clap::value_parser!(u32).range(1..))]
    pub iterations: u32,
    /// Measured time of a step at this photo size, ms, to estimate the training time.
    #[arg(long, value_name = "MS", requires = "step_gaussians")]
    pub step_ms: Option<f64>,
    /// Number of Gaussians in the measurement of --step-ms.
    #[arg(long, value_name = "N", value_parser = count, requires = "step_ms")]
    pub step_gaussians: Option<u64>,
}

/// Shows the blocks of a scene on paper.
pub(super) fn run(args: &EstimateArgs, context: &Context) -> Result<()> {
    let found = estimate(&PlannedScene {
        card: args.card,
        gaussians: args.gaussians,
        coarse: args.coarse.unwrap_or(args.gaussians / 4),
        views: args.views,
        image: (args.size.0, args.size.1),
        max_label: (args.labels > 0).then_some(args.labels),
        steps: args.iterations,
        pace: args.step_ms.map(|ms| ms / 1000.0).zip(args.step_gaussians),
    })?;
    context.show(&to_json(&found), &to_text(&found))
}

fn hours(found: &Estimate) -> Option<f64> {
    found.need.minutes.map(|minutes| minutes / 60.0)
}

fn to_text(found: &Estimate) -> String {
    let time = match hours(found) {
        Some(hours) => format!("{hours:.1} hours per block, {:.0} GPU hours in total", hours * found.blocks as f64),
        None => "unknown time (see --step-ms)".to_owned(),
    };
    format!(
        "{}, each with {}, {} frozen Gaussians around it, and {}\n{} MiB of GPU memory, {} MiB of host memory\n\
         {}, {time}\n",
        counted(found.blocks, "block"),
        counted(found.gaussians, "Gaussian"),
        found.frozen,
        counted(found.views, "view"),
        found.need.device.div_ceil(MIB_BYTES),
        found.need.host.div_ceil(MIB_BYTES),
        counted(found.need.steps, "step")
    )
}

fn to_json(found: &Estimate) -> serde_json::Value {
    json!({
        "schema_version": 1,
        "blocks": found.blocks,
        "gaussians": found.gaussians,
        "frozen": found.frozen,
        "views": found.views,
        "device_mib": found.need.device.div_ceil(MIB_BYTES),
        "host_mib": found.need.host.div_ceil(MIB_BYTES),
        "steps": found.need.steps,
        "hours": hours(found),
        "card_hours": hours(found).map(|hours| hours * found.blocks as f64),
    })
}
