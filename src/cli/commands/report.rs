//! `labelgs report`: the pages of trainings, made anew from the files in their folders.

use crate::Result;
use crate::cli::support::Context;
use crate::cli::support::parsers::page_file;
use crate::run::report::{REPORT_FILE, write};
use clap::Args;
use serde_json::json;
use std::path::{Path, PathBuf};

/// `labelgs report`.
#[derive(Args, Clone, Debug)]
pub struct ReportArgs {
    /// Output folder of `labelgs train`. Give several to compare their numbers in columns and their curves in shared
    /// charts.
    #[arg(value_name = "RUN", required = true)]
    pub runs: Vec<PathBuf>,
    /// Page to write. Default: RUN/report.html, or report.html in the current folder for several runs.
    #[arg(short, long, value_name = "FILE", value_parser = page_file())]
    pub output: Option<PathBuf>,
}

/// Writes the page and prints its path.
pub(crate) fn run(args: &ReportArgs, context: &Context) -> Result<()> {
    let usual = match args.runs.as_slice() {
        [run] => run.join(REPORT_FILE),
        _ => Path::new(REPORT_FILE).to_owned(),
    };
    let path = write(&args.runs, args.output.as_ref().unwrap_or(&usual))?;
    let path = path.display().to_string();
    context.show(&json!({ "report": path }), &format!("{path}\n"))
}
