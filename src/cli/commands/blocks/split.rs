//! `labelgs blocks split`.

use crate::Result;
use crate::blocks::{self, BlockRow, Plan, PlanOptions};
use crate::cli::support::parsers::{bytes, count, direction};
use crate::cli::support::{Context, ReadArgs, open_gpu};
use crate::files::atomic;
use crate::scenes::LoadOptions;
use crate::words::counted;
use clap::Args;
use glam::DVec3;
use serde_json::json;
use std::path::PathBuf;

/// `labelgs blocks split`.
#[derive(Args, Clone, Debug)]
pub struct SplitArgs {
    /// Scene: a folder or a file.
    #[arg(value_name = "SCENE")]
    pub scene: PathBuf,
    /// Run of the whole scene at low resolution or with few Gaussians.
    #[arg(long, value_name = "COARSE")]
    pub model: PathBuf,
    /// New folder for the blocks.
    #[arg(short, long, value_name = "BLOCKS", required_unless_present = "dry_run")]
    pub output: Option<PathBuf>,
    /// Only show the blocks with their Gaussians, memory and time; write nothing.
    #[arg(long, conflicts_with = "output")]
    pub dry_run: bool,
    /// Memory of the GPU that trains the blocks, such as 24G.
    #[arg(long, alias = "gpu-memory", value_name = "SIZE", value_parser = bytes)]
    pub card: u64,
    /// Gaussians of the whole scene after densification, such as 40M. Default: four times the coarse model.
    #[arg(long, value_name = "N", value_parser = count)]
    pub gaussians: Option<u64>,
    /// Minimum number of blocks.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub blocks: usize,
    /// Maximum number of views per block; the views that show most of the block are used.
    #[arg(long, value_name = "N", default_value_t = PlanOptions::default().max_views)]
    pub max_views: usize,
    /// Longest side of the photos in block training, px; 0 keeps the full size.
    #[arg(long, value_name = "PX", default_value_t = 0)]
    pub max_resolution: u32,
    /// Steps for a block of up to 300 views; larger blocks get proportionally more. Default: the steps of the coarse
    /// run.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub iterations: Option<u32>,
    /// Up direction of the scene: x, -x, y, -y, z, -z or X,Y,Z. Default: the mean up direction of the cameras.
    #[arg(long, value_name = "DIRECTION", value_parser = direction, allow_hyphen_values = true)]
    pub up: Option<DVec3>,
    #[command(flatten)]
    pub read: ReadArgs,
}

/// Writes the blocks and shows them.
pub(super) fn run(args: &SplitArgs, context: &Context) -> Result<()> {
    args.output.as_ref().map_or(Ok(()), |folder| atomic::require_empty("--output", folder))?;
    let plan = planned(args, context)?;
    args.output.as_ref().map_or(Ok(()), |folder| blocks::split(&plan, folder))?;
    let rows = plan.rows();
    let result = json!({ "schema_version": 1, "card": args.card, "far": plan.far, "blocks": rows });
    context.show(&result, &to_text(&plan, &rows))
}

fn planned(args: &SplitArgs, context: &Context) -> Result<Plan> {
    let options = PlanOptions {
        card: args.card,
        gaussians: args.gaussians.unwrap_or(0),
        blocks: args.blocks,
        max_views: args.max_views,
        max_resolution: args.max_resolution,
        steps: args.iterations.unwrap_or(0),
        up: args.up,
        load: args.read.options(LoadOptions::default()),
    };
    blocks::plan(&args.scene, &args.model, &options, &|| open_gpu(context))
}

fn to_text(plan: &Plan, rows: &[BlockRow]) -> String {
    let mut text = format!(
        "{:<6} {:>6} {:>10} {:>10} {:>10} {:>8} {:>8} {:>7} {:>8}\n",
        "block", "views", "start", "Gaussians", "frozen", "MiB", "host MiB", "steps", "minutes"
    );
    for block in rows {
        let minutes = block.minutes.map_or("unknown".to_owned(), |minutes| format!("{minutes:.1}"));
        let note = if block.trained { "" } else { "  too few views: stays coarse" };
        text += &format!(
            "{:<6} {:>6} {:>10} {:>10} {:>10} {:>8} {:>8} {:>7} {minutes:>8}{note}\n",
            block.id,
            block.views,
            block.start,
            block.gaussians,
            block.frozen,
            block.device_mib,
            block.host_mib,
            block.steps,
        );
    }
    let trained = || rows.iter().filter(|block| block.trained);
    let hours = trained().map(|block| block.minutes).sum::<Option<f64>>().map(|minutes| minutes / 60.0);
    let hours = hours.map_or("unknown time".to_owned(), |hours| format!("{hours:.2} GPU hours"));
    text + &format!(
        "{}, {hours} at the speed of the coarse run; {} coarse\n",
        counted(trained().count(), "block"),
        if plan.far == 1 { "1 far Gaussian stays".to_owned() } else { format!("{} far Gaussians stay", plan.far) }
    )
}
