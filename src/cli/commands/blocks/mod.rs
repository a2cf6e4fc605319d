//! `labelgs blocks`: a scene larger than a GPU.

mod estimate;
mod join;
mod split;

use crate::Result;
use crate::cli::support::Context;
use clap::Subcommand;

/// The commands for blocks.
#[derive(Clone, Debug, Subcommand)]
pub enum BlocksVerb {
    /// Estimate the number of blocks of a scene before training anything.
    ///
    /// Example: labelgs blocks estimate --gaussians 100M --views 5000 --card 24G
    Estimate(estimate::EstimateArgs),
    /// Write a folder per block for `labelgs train --block`, and show its Gaussians, memory and time.
    ///
    /// Example: labelgs blocks split scene --model coarse --card 24G -o blocks
    Split(split::SplitArgs),
    /// Join the trained blocks into one model.
    ///
    /// Example: labelgs blocks join blocks --models models -o city
    Join(join::JoinArgs),
}

impl BlocksVerb {
    /// Runs the command.
    pub(crate) fn run(&self, context: &Context) -> Result<()> {
        match self {
            Self::Estimate(args) => estimate::run(args, context),
            Self::Split(args) => split::run(args, context),
            Self::Join(args) => join::run(args, context),
        }
    }
}
