//! `labelgs blocks join`.

use crate::Result;
use crate::blocks::{BlockMasks, MergeOptions, MergeResult, merge};
use crate::cli::support::{Context, open_gpu};
use clap::Args;
use std::path::PathBuf;

/// `labelgs blocks join`.
#[derive(Args, Clone, Debug)]
pub struct JoinArgs {
    /// Folder that `labelgs blocks split` wrote.
    #[arg(value_name = "BLOCKS")]
    pub blocks: PathBuf,
    /// Folder of the trainings: a folder for each block, with its name.
    #[arg(short, long, value_name = "DIR")]
    pub models: PathBuf,
    /// Folder of the merged model, which other commands take as that of a run.
    #[arg(short, long, value_name = "CITY")]
    pub output: PathBuf,
    /// Take the coarse Gaussians where a block has no finished training.
    #[arg(long)]
    pub allow_missing: bool,
    /// Masks whose ids agree within a block only: a folder for each block, with its name. Objects get one id where blocks
    /// share photos.
    #[arg(long, value_name = "DIR", requires = "scene")]
    pub block_masks: Option<PathBuf>,
    /// Scene of the photos, for --block-masks.
    #[arg(long, value_name = "SCENE", requires = "block_masks")]
    pub scene: Option<PathBuf>,
}

/// Joins the blocks.
pub(super) fn run(args: &JoinArgs, context: &Context) -> Result<()> {
    let open = || open_gpu(context);
    let masks = args.scene.as_deref().zip(args.block_masks.as_deref());
    let masks = masks.map(|(scene, masks)| BlockMasks { scene, masks, open: &open });
    let options = MergeOptions { allow_missing: args.allow_missing, masks };
    let merged = merge(&args.blocks, &args.models, &args.output, &options)?;
    context.show(&merged.to_json(), &sentence(&merged))
}

fn sentence(merged: &MergeResult) -> String {
    let (model, all, coarse) = (merged.model.display(), merged.gaussians(), merged.coarse);
    let blocks = merged.blocks.len();
    let mut text = format!("{model}: {all} Gaussians, {coarse} of them coarse, the others of {blocks} blocks\n");
    if merged.devices.len() > 1 {
        text += &format!("trained on {}: another device makes other bits\n", merged.devices.join("; "));
    }
    text
}
