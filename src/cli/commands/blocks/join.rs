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
    /// Folder of the trained blocks: a run per block, named after the block.
    #[arg(short, long, value_name = "DIR")]
    pub models: PathBuf,
    /// Folder for the joined model; other commands accept it like a run.
    #[arg(short, long, value_name = "CITY")]
    pub output: PathBuf,
    /// Use the coarse Gaussians for blocks without a finished run.
    #[arg(long)]
    pub allow_missing: bool,
    /// Folder of masks whose ids match within a block only: a subfolder per block, named after the block. Ids are
    /// matched in photos that blocks share.
    #[arg(long, value_name = "DIR", requires = "scene")]
    pub block_masks: Option<PathBuf>,
    /// Scene with the photos of --block-masks.
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
    let mut text = format!("{model}: {all} Gaussians, {coarse} of them coarse, the rest from {blocks} blocks\n");
    if merged.devices.len() > 1 {
        text += &format!("trained on {}; other devices give slightly different results\n", merged.devices.join("; "));
    }
    text
}
