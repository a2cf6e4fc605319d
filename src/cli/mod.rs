//! The command line: what is typed (`command`), a file per command (`commands`), and what they share (`support`).

pub mod command;
pub mod commands;
pub mod support;

use crate::error::name_settings;
use crate::{Error, version};
use clap::FromArgMatches;
use command::{Cli, command, has_json, with_headings};
use std::ffi::OsString;
use std::panic::{AssertUnwindSafe, catch_unwind};
use support::context::Context;
use support::{exit_status, log, number_errors, setting_names, settings, signals, stdout};

/// Parses `args`, runs the command, reports an error and returns the exit status. `commit` is that of the program.
pub fn main(args: impl IntoIterator<Item = OsString>, commit: Option<&'static str>) -> u8 {
    version::note_commit(commit);
    std::panic::set_hook(Box::new(|panic| {
        let place = panic.location().map_or(String::new(), |place| format!(" at {}:{}", place.file(), place.line()));
        let payload = panic.payload();
        let text = payload.downcast_ref::<&str>().copied().or(payload.downcast_ref::<String>().map(String::as_str));
        let text = text.unwrap_or("panic");
        let trace = std::backtrace::Backtrace::capture();
        let trace = match trace.status() {
            std::backtrace::BacktraceStatus::Captured => format!("\n{trace}"),
            _ => String::new(),
        };
        log::final_error(&Error::Bug(format!("{text}{place}{trace}")));
    }));
    let args: Vec<OsString> = args.into_iter().collect();
    let status = match catch_unwind(AssertUnwindSafe(|| run(args))) {
        Ok(Ok(())) => 0,
        Ok(Err(Exit::Clap(error))) => {
            // A closed pipe while help is printed is not an error.
            let _ = error.print();
            error.exit_code()
        }
        Ok(Err(Exit::Error(error))) if stdout::is_closed(&error) => 0,
        Ok(Err(Exit::Error(error))) => {
            log::final_error(&error);
            exit_status::exit_status(&error)
        }
        Err(_) => exit_status::BUG_STATUS,
    };
    u8::try_from(status).unwrap_or(u8::MAX)
}

/// Why a run ended early.
enum Exit {
    Clap(clap::Error),
    Error(Error),
}

impl From<Error> for Exit {
    fn from(error: Error) -> Self {
        Self::Error(error)
    }
}

impl From<clap::Error> for Exit {
    fn from(error: clap::Error) -> Self {
        Self::Clap(error)
    }
}

fn run(args: Vec<OsString>) -> Result<(), Exit> {
    let mut command = with_headings(command());
    let typed = command.try_get_matches_from_mut(args).map_err(number_errors::in_words)?;
    name_settings(setting_names::names(&command, &typed));
    if let Some(("train", words)) = typed.subcommand()
        && let Some(only) = settings::asked(words)
    {
        return Ok(stdout::print(&settings::list(only)?)?);
    }
    let cli = Cli::from_arg_matches(&typed)?;
    log::start(&cli.global);
    signals::install()?;
    let context = Context::new(cli.global, cli.json || has_json(&typed));
    cli.command.run(&context)?;
    Ok(context.check_rules()?)
}
