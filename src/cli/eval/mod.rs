//! `labelgs eval`: the scores of a model, by its own masks or by a published benchmark.

mod args;
mod bench;
mod own;
mod table;
mod watch;

pub(crate) use args::EvalArgs;
pub(super) use own::score;

use super::context::Context;
use super::stdout;
use crate::Result;
use crate::files::atomic::write_json;

/// Scores a model.
pub(crate) fn run(args: &EvalArgs, context: &Context) -> Result<()> {
    match args.protocol {
        Some(protocol) => bench::run(protocol, args, context),
        None => own::run(args, context),
    }
}

/// Writes or prints the scores as JSON if asked to. Prints the table unless JSON is printed.
fn put_out(scores: &impl serde::Serialize, table: &str, args: &EvalArgs, context: &Context) -> Result<()> {
    match &args.json {
        Some(Some(file)) => write_json(file, scores)?,
        Some(None) => return stdout::print_json(scores),
        None => {}
    }
    if context.json { stdout::print_json(scores) } else { stdout::print(table) }
}
