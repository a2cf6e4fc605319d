//! `labelgs eval`: the scores of a model, by its own masks or by a published benchmark.

mod args;
mod bench;
mod own;
mod table;
mod watch;

pub use args::EvalArgs;
pub use own::read_outline;
pub(super) use own::score;

use super::context::Context;
use super::stdout;
use crate::eval::scores::Scores;
use crate::io::atomic;
use crate::{Error, Result};
use std::path::Path;

/// Scores a model.
pub fn run(args: &EvalArgs, context: &Context) -> Result<()> {
    match args.protocol {
        Some(protocol) => bench::run(protocol, args, context),
        None => own::run(args, context),
    }
}

/// Points to a view that is seen much worse than the others, and to what helps most often: Gaussians hang in the air before
/// its camera, where no photo of the training shows them.
pub fn warn_of_odd_view(scores: &Scores, near: f32) {
    if let Some((name, found, median)) = scores.odd_view() {
        tracing::warn!(
            "view {name} has {found:.1} dB, the one in the middle {median:.1}: if it is foggy, try --near of a tenth of the \
             distance to what is seen (it is {near})"
        );
    }
}

/// Writes scores as JSON.
pub fn write_json(file: &Path, scores: &impl serde::Serialize) -> Result<()> {
    let text = serde_json::to_string_pretty(scores).map_err(|error| Error::Bug(format!("JSON: {error}")))?;
    atomic::write(file, |out| out.write_all(text.as_bytes()))
}

/// Scores where they were asked for: JSON in a file or printed, and the table unless JSON is printed.
fn put_out(scores: &impl serde::Serialize, table: &str, args: &EvalArgs, context: &Context) -> Result<()> {
    match &args.json {
        Some(Some(file)) => write_json(file, scores)?,
        Some(None) => return stdout::print_json(scores),
        None => {}
    }
    if context.json { stdout::print_json(scores) } else { stdout::print(table) }
}
