//! `labelgs masks`: what is done with masks before training.

pub(crate) mod check;
pub(crate) mod collect;
pub(crate) mod import;
pub(crate) mod repair;
pub(crate) mod spoil;
pub(crate) mod track;

use super::context::Context;
use crate::cli::args::ReadArgs;

use crate::io::image::{write_png_grey8, write_png_grey16};
use crate::io::read;
use crate::io::{self, LoadOptions};
use crate::scene::{Dataset, LabelMap};
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
    /// Convert masks of trackers and data sets to one id picture per photo, with labels.json.
    #[command(after_help = "Example: labelgs masks import deva_out --scene garden -o garden/masks")]
    Import(import::ImportArgs),
    /// Report missing, mis-sized, mis-named, inverted and nearly empty masks, and ids that come and go.
    #[command(
        after_help = "Exit status 1 if anything was found. Example: labelgs masks check garden/masks --scene garden"
    )]
    Check(check::CheckArgs),
    /// Take the masks of the photos out of a tracker's output on the video of `labelgs densify`.
    #[command(after_help = "Example: labelgs masks collect tracked --frames video/frames.json -o masks")]
    Collect(collect::CollectArgs),
    /// Give ids that go from frame to frame by overlap to the masks of a segmenter of single pictures.
    #[command(after_help = "Example: labelgs masks track segmented -o tracked, between densify and collect")]
    Track(track::TrackArgs),
    /// Make masks of all views agree, by the Gaussians of a trained model that they own.
    #[command(after_help = "Example: labelgs masks repair sam_masks --per-view --model out --scene garden -o masks")]
    Repair(repair::RepairArgs),
    /// Put faults of trackers into right masks, to test what a method does with them.
    Spoil(spoil::SpoilArgs),
}

/// Does it.
pub(crate) fn run(args: &MasksArgs, context: &Context) -> Result<()> {
    match &args.verb {
        MasksVerb::Import(args) => import::run(args, context),
        MasksVerb::Check(args) => check::run(args, context),
        MasksVerb::Collect(args) => collect::run(args, context),
        MasksVerb::Track(args) => track::run(args, context),
        MasksVerb::Repair(args) => repair::run(args, context),
        MasksVerb::Spoil(args) => spoil::run(args, context),
    }
}

/// Reads the scene that masks belong to: names, sizes and cameras of its photos, and its points.
fn open_photos(scene: &Path, read: ReadArgs) -> Result<Dataset> {
    let options = LoadOptions { photos: false, test_every: None, ..LoadOptions::default() };
    io::open_logged(scene, &read.into_options(options))
}

/// Writes ids as grey, with 8 bits where they suffice.
fn write_mask(path: &Path, mask: &LabelMap) -> Result<()> {
    if mask.ids.iter().all(|&id| id <= u16::from(u8::MAX)) {
        let bytes: Vec<u8> = mask.ids.iter().map(|&id| id as u8).collect();
        return write_png_grey8(path, mask.width, mask.height, &bytes);
    }
    write_png_grey16(path, mask.width, mask.height, &mask.ids)
}

/// Names of the PNGs of a folder, sorted.
fn pngs(folder: &Path) -> Result<Vec<String>> {
    let entries = read::folder(folder)?;
    let names = entries.iter().filter_map(|path| path.file_name()?.to_str().map(str::to_owned));
    let mut names: Vec<String> = names.filter(|name| name.ends_with(".png")).collect();
    names.sort();
    if names.is_empty() {
        return Err(Error::data(folder, "", "holds no PNG; expected a folder of id masks"));
    }
    Ok(names)
}
