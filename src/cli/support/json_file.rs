//! `--json FILE`.

use crate::Result;
use crate::cli::support::context::Context;
use crate::cli::support::stdout;
use crate::files::atomic::write_json;
use clap::Args;
use serde::Serialize;
use std::path::PathBuf;

/// `--json` of a command with many numbers.
#[derive(Args, Clone, Debug, Default)]
pub struct JsonFileArg {
    /// Write all numbers as JSON to FILE, or print them without FILE.
    #[arg(id = "json_file", long = "json", value_name = "FILE", num_args = 0..=1, help_heading = "Output")]
    pub file: Option<Option<PathBuf>>,
}

impl JsonFileArg {
    /// Writes or prints the result as JSON if asked to. Prints the text unless JSON is printed.
    pub(crate) fn put_out(&self, result: &impl Serialize, text: &str, context: &Context) -> Result<()> {
        match &self.file {
            Some(Some(file)) => write_json(file, result)?,
            Some(None) => return stdout::print_json(result),
            None => {}
        }
        context.show(result, text)
    }
}
