//! `labelgs masks track`: ids that follow objects from frame to frame by overlap.

use super::{pngs, write_mask};
use crate::cli::support::Context;
use crate::cli::support::parsers::share;
use crate::files::atomic;
use crate::label::masks::track::{Overlap, track};
use crate::masks::mask::read_mask;
use crate::scene::LabelMap;
use crate::{Error, Result};
use clap::Args;
use serde_json::json;
use std::collections::BTreeSet;
use std::path::PathBuf;

/// `labelgs masks track`.
#[derive(Args, Clone, Debug)]
pub struct TrackArgs {
    /// Folder of id images, PNG, one per frame, in name order. Ids may differ from frame to frame.
    #[arg(value_name = "SEGMENTED")]
    pub segmented: PathBuf,
    /// Folder to write; must be new or empty.
    #[arg(short, long, value_name = "TRACKED")]
    pub output: PathBuf,
    /// Minimum IoU of an object between two frames.
    #[arg(long, value_name = "IOU", value_parser = share, default_value_t = 0.1)]
    pub min_overlap: f32,
    /// Number of frames without the object after which its id is dropped.
    #[arg(long, value_name = "FRAMES", default_value_t = 5)]
    pub memory: usize,
}

/// Writes the frames with ids that agree.
pub(crate) fn run(args: &TrackArgs, context: &Context) -> Result<()> {
    atomic::require_empty("--output", &args.output)?;
    let names = pngs(&args.segmented)?;
    let frames: Vec<LabelMap> = names.iter().map(|name| read_mask(args.segmented.join(name))).collect::<Result<_>>()?;
    let size = |frame: &LabelMap| (frame.width, frame.height);
    if let Some(other) = frames.iter().position(|frame| size(frame) != size(&frames[0])) {
        let ((w, h), (width, height)) = (size(&frames[other]), size(&frames[0]));
        let problem = format!("has {w} x {h} px and {} {width} x {height} px; all frames need one size", names[0]);
        return Err(Error::data(args.segmented.join(&names[other]), "", problem));
    }
    let tracked = track(&frames, Overlap { least: f64::from(args.min_overlap), memory: args.memory })?;
    for (name, frame) in names.iter().zip(&tracked) {
        write_mask(&args.output.join(name), frame)?;
    }
    let objects: BTreeSet<u16> = tracked.iter().flat_map(LabelMap::objects).collect();
    let (frames, objects) = (names.len(), objects.len());
    let text = format!("{}: {objects} objects in {frames} frames\n", args.output.display());
    context.show(&json!({ "schema_version": 1, "frames": frames, "objects": objects }), &text)
}
