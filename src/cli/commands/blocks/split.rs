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
    /// Folder or file of the scene.
    #[arg(value_name = "SCENE")]
    pub scene: PathBuf,
    /// Folder of a training of the whole scene, of low resolution or few Gaussians.
    #[arg(long, value_name = "COARSE")]
    pub model: PathBuf,
    /// New folder for the blocks.
    #[arg(short, long, value_name = "BLOCKS", required_unless_present = "dry_run")]
    pub output: Option<PathBuf>,
    /// Show the blocks, with Gaussians, memory and time of each, and write nothing.
    #[arg(long, conflicts_with = "output")]
    pub dry_run: bool,
    /// Memory of the card that trains the blocks, such as 24G.
    #[arg(long, value_name = "SIZE", value_parser = bytes)]
    pub card: u64,
    /// Gaussians of the whole scene at the end of growth, such as 40M. Default: four times those of the coarse model.
    #[arg(long, value_name = "N", value_parser = count)]
    pub gaussians: Option<u64>,
    /// Fewest blocks, whatever the card.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub blocks: usize,
    /// Most views of a block; those that show most of it are taken.
    #[arg(long, value_name = "N", default_value_t = PlanOptions::default().max_views)]
    pub max_views: usize,
    /// Longest side of the photos in the trainings of the blocks, px; 0 for their full size.
    #[arg(long, value_name = "PX", default_value_t = 0)]
    pub max_resolution: u32,
    /// Steps of a block of up to 300 views; more views have more in proportion. Default: those of the coarse training.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub iterations: Option<u32>,
    /// Direction of the scene that points up: x, -x, y, -y, z, -z or X,Y,Z. Default: that of the cameras.
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
    let hours = hours.map_or("an unknown time".to_owned(), |hours| format!("{hours:.2} card hours"));
    text + &format!(
        "{}, {hours} at the pace of the coarse training; {} coarse\n",
        counted(trained().count(), "block"),
        if plan.far == 1 { "1 far Gaussian stays".to_owned() } else { format!("{} far Gaussians stay", plan.far) }
    )
}
