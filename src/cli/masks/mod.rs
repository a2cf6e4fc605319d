//! `labelgs masks`: what is done with masks before training.

pub mod repair;
pub mod spoil;

use super::Context;
use crate::io::image::{write_png_grey8, write_png_grey16};
use crate::scene::LabelMap;
use crate::{Error, Result};
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
    /// Make masks of all views agree, by the Gaussians of a trained model that they own.
    #[command(after_help = "Example: labelgs masks repair sam_masks --per-view --model out --scene garden -o masks")]
    Repair(repair::RepairArgs),
    /// Put faults of trackers into right masks, to test what a method does with them.
    Spoil(spoil::SpoilArgs),
}

/// Does it.
pub fn run(args: &MasksArgs, context: &Context) -> Result<()> {
    match &args.verb {
        MasksVerb::Repair(args) => repair::run(args, context),
        MasksVerb::Spoil(args) => spoil::run(args, context),
    }
}

/// Refuses a folder that holds something: old masks among new ones would be read as one set.
fn refuse_used(folder: &Path) -> Result<()> {
    let used = std::fs::read_dir(folder).is_ok_and(|mut entries| entries.next().is_some());
    if used {
        return Err(Error::usage("--output", format!("{} is not empty; name a new folder", folder.display())));
    }
    Ok(())
}

/// Writes ids as grey, with 8 bits where they suffice.
fn write_mask(path: &Path, mask: &LabelMap) -> Result<()> {
    if mask.ids.iter().all(|&id| id <= u16::from(u8::MAX)) {
        let bytes: Vec<u8> = mask.ids.iter().map(|&id| id as u8).collect();
        return write_png_grey8(path, mask.width, mask.height, &bytes);
    }
    write_png_grey16(path, mask.width, mask.height, &mask.ids)
}
