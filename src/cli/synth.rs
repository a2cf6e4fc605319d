//! `labelgs synth`.

use super::args::SynthArgs;
use super::log::Progress;
use super::{Context, interrupt, stdout};
use crate::Result;
use crate::synth::{SynthOptions, write};
use std::cell::RefCell;

/// Makes the scene.
pub fn run(args: &SynthArgs, context: &Context) -> Result<()> {
    let options = SynthOptions {
        preset: args.preset,
        width: args.size.0,
        height: args.size.1,
        views: args.views,
        points: args.points,
        seed: args.seed,
    };
    interrupt::note_only();
    let progress = RefCell::new(Progress::new(u64::from(options.views), "views", &context.global));
    let summary = write(&options, &args.folder, &|done| {
        progress.borrow_mut().set(u64::from(done), String::new);
        interrupt::check()
    });
    drop(progress);
    let summary = summary?;
    if context.json || args.json.json {
        return stdout::print_json(&summary);
    }
    let objects: Vec<String> = summary
        .objects
        .iter()
        .map(|object| format!("{} {}", object.id, object.name.as_deref().unwrap_or_default()))
        .collect();
    stdout::print(&format!(
        "{}: {} views of {} x {} px, {} points; objects: {}\n",
        summary.scene.display(),
        summary.views,
        options.width,
        options.height,
        summary.points,
        objects.join(", ")
    ))
}
