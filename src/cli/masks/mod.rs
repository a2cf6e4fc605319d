//! `labelgs masks`: what is done with masks before training.

pub mod collect;

use super::Context;
use crate::Result;
use clap::Subcommand;

/// What to do with masks.
#[derive(Clone, Debug, Subcommand)]
pub enum MasksCommand {
    /// Take the masks of the photos out of a tracker's output on the video of `labelgs densify`.
    #[command(after_help = "Example: labelgs masks collect tracked --frames video/frames.json -o masks")]
    Collect(collect::CollectArgs),
}

/// Does it.
pub fn run(command: &MasksCommand, context: &Context) -> Result<()> {
    match command {
        MasksCommand::Collect(args) => collect::run(args, context),
    }
}
