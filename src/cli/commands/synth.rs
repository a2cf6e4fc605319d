//! `labelgs synth`.

use crate::Result;
use crate::cli::support::parsers::{Size, size};
use crate::cli::support::{Context, Progress, signals};
use crate::synth::{Preset, SynthLens, SynthOptions, write};
use crate::words::counted;
use clap::Args;
use std::cell::RefCell;
use std::path::PathBuf;

/// `labelgs synth`.
#[derive(Args, Clone, Debug)]
pub struct SynthArgs {
    /// Folder to write; must be new or empty.
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
    /// Set of objects.
    #[arg(long, value_name = "PRESET", value_enum, default_value = "default")]
    pub preset: Preset,
    /// Image size, px.
    #[arg(long, value_name = "WxH", value_parser = size, default_value = "320x240")]
    pub size: Size,
    /// Number of views. Default: 40, or 200 for a city.
    #[arg(long, value_name = "N")]
    pub views: Option<u32>,
    /// Number of 3D points. Default: 4000, or 20000 for a city.
    #[arg(long, value_name = "N")]
    pub points: Option<u32>,
    /// Random seed of colours, camera jitter and points.
    #[arg(long, value_name = "SEED", default_value_t = 0)]
    pub seed: u64,
    /// Camera model of COLMAP, with typical lens coefficients. For models with distortion, only photos, poses and masks
    /// are written.
    #[arg(long, value_name = "MODEL", default_value_t = SynthLens::default())]
    pub lens: SynthLens,
    /// Horizontal field of view, degrees. Default: 50 for 4:3 images; EQUIRECTANGULAR always covers everything.
    #[arg(long, value_name = "DEGREES")]
    pub fov: Option<u32>,
    /// Vary exposure (gains of 0.7 to 1.4) and white balance from photo to photo, as an automatic camera does.
    #[arg(long)]
    pub vary_exposure: bool,
}

/// Writes the scene.
pub(crate) fn run(args: &SynthArgs, context: &Context) -> Result<()> {
    let of_preset = SynthOptions::for_preset(args.preset);
    let options = SynthOptions {
        preset: args.preset,
        width: args.size.0,
        height: args.size.1,
        views: args.views.unwrap_or(of_preset.views),
        points: args.points.unwrap_or(of_preset.points),
        seed: args.seed,
        lens: args.lens,
        fov: args.fov,
        vary_exposure: args.vary_exposure,
    };
    signals::note_only();
    let progress = RefCell::new(Progress::new(u64::from(options.views), "views", &context.global));
    let summary = write(&options, &args.folder, &|done| {
        progress.borrow_mut().set(u64::from(done), String::new);
        signals::check()
    });
    drop(progress);
    let summary = summary?;
    let objects: Vec<String> = summary
        .objects
        .iter()
        .map(|object| format!("{} {}", object.id, object.name.as_deref().unwrap_or_default()))
        .collect();
    let text = format!(
        "{}: {} of {} x {} px, {}; objects: {}\n",
        summary.scene.display(),
        counted(summary.views, "view"),
        options.width,
        options.height,
        counted(summary.points, "point"),
        objects.join(", ")
    );
    context.show(&summary, &text)
}
