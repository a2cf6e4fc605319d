//! `labelgs blocks`: a scene larger than a card.

mod estimate;
mod join;
mod split;

use crate::Result;
use crate::cli::support::Context;
use clap::Subcommand;

/// The commands for blocks.
#[derive(Clone, Debug, Subcommand)]
pub enum BlocksVerb {
    /// Show on paper how many blocks a scene takes, before anything is trained.
    ///
    /// Example: labelgs blocks estimate --gaussians 100M --views 5000 --card 24G
    Estimate(estimate::EstimateArgs),
    /// Write a folder for each block, for `labelgs train --block`, and show Gaussians, memory and time of each.
    ///
    /// Example: labelgs blocks split scene --model coarse --card 24G -o blocks
    Split(split::SplitArgs),
    /// Join the trained models of the blocks into one.
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
