//! `labelgs masks`: what is done with masks before training.

pub mod check;
pub mod import;

use super::Context;
use crate::Result;
use crate::cli::scene::open_with;
use crate::io::LoadOptions;
use crate::scene::Dataset;
use clap::{Args, Subcommand};
use std::path::Path;

/// `labelgs masks`.
#[derive(Args, Clone, Debug)]
pub struct MasksArgs {
    /// What to do.
    #[command(subcommand)]
    pub verb: MasksVerb,
}

/// What can be done with masks.
#[derive(Clone, Debug, Subcommand)]
pub enum MasksVerb {
    /// Convert masks of trackers and data sets to one id picture per photo, with labels.json.
    #[command(after_help = "Example: labelgs masks import deva_out --scene garden -o garden/masks")]
    Import(import::ImportArgs),
    /// Report missing, mis-sized, mis-named, inverted and nearly empty masks, and ids that come and go.
    #[command(
        after_help = "Exit status 1 if anything was found. Example: labelgs masks check garden/masks --scene garden"
    )]
    Check(check::CheckArgs),
}

/// Does it.
pub fn run(args: &MasksArgs, context: &Context) -> Result<()> {
    match &args.verb {
        MasksVerb::Import(args) => import::run(args, context),
        MasksVerb::Check(args) => check::run(args, context),
    }
}

/// Reads the scene that masks belong to: names, sizes and cameras of its photos, and its points.
fn open_photos(scene: &Path) -> Result<Dataset> {
    open_with(scene, &LoadOptions { photos: false, test_every: None, ..LoadOptions::default() })
}
