//! `labelgs blocks`: a scene larger than a card.

mod divide;
mod estimate;
mod merge;

use super::context::Context;
use crate::Result;
use clap::{Args, Subcommand};

/// `labelgs blocks`.
#[derive(Args, Clone, Debug)]
pub struct BlocksArgs {
    /// The command.
    #[command(subcommand)]
    pub verb: BlocksVerb,
}

/// The commands for blocks.
#[derive(Clone, Debug, Subcommand)]
pub enum BlocksVerb {
    /// Show into how many blocks a scene is split, and the Gaussians, memory and time of each.
    ///
    /// Example: labelgs blocks plan scene --model coarse --card 24G
    Plan(divide::DivideArgs),
    /// Show on paper how many blocks a scene takes, before anything is trained.
    ///
    /// Example: labelgs blocks estimate --gaussians 100M --views 5000 --card 24G
    Estimate(estimate::EstimateArgs),
    /// Write a folder for each block, for `labelgs train --block`.
    ///
    /// Example: labelgs blocks split scene --model coarse --card 24G -o blocks
    Split(divide::SplitArgs),
    /// Join the trained models of the blocks into one.
    ///
    /// Example: labelgs blocks merge blocks --models models -o city
    Merge(merge::MergeArgs),
}

/// Runs a command for blocks.
pub(crate) fn run(args: &BlocksArgs, context: &Context) -> Result<()> {
    match &args.verb {
        BlocksVerb::Plan(args) => divide::plan(args, context),
        BlocksVerb::Estimate(args) => estimate::run(args, context),
        BlocksVerb::Split(args) => divide::split(args, context),
        BlocksVerb::Merge(args) => merge::run(args, context),
    }
}
