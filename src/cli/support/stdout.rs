//! Results, on standard output.

use crate::{Error, Result};
use std::io::{ErrorKind, Write};

const STDOUT_NAME: &str = "standard output";

/// Prints text as it is.
pub(crate) fn print(text: &str) -> Result<()> {
    let mut out = std::io::stdout().lock();
    out.write_all(text.as_bytes()).and_then(|()| out.flush()).map_err(Error::write(STDOUT_NAME))
}

/// Prints a value as one line of JSON.
pub(crate) fn print_json(value: &impl serde::Serialize) -> Result<()> {
    let text = serde_json::to_string(value).map_err(|error| Error::Bug(format!("JSON: {error}")))?;
    print(&format!("{text}\n"))
}

/// Returns true if the reader of standard output closed it, as `head` does.
pub(crate) fn is_closed(error: &Error) -> bool {
    matches!(error, Error::Write { path, source }
        if path.as_os_str() == STDOUT_NAME && source.kind() == ErrorKind::BrokenPipe)
}
