//! Combines the errors of many files into one.

use labelgs_scene::{Error, Result};
use std::path::Path;

/// Most errors listed in one message.
const LISTED_MAX: usize = 20;

/// Returns the loaded views, or one error that lists all failures.
pub fn all_or_one_error<T>(root: &Path, loaded: Vec<Result<T>>) -> Result<Vec<T>> {
    let total = loaded.len();
    let mut errors = Vec::new();
    let views = loaded.into_iter().filter_map(|view| view.map_err(|error| errors.push(error)).ok()).collect();
    match errors.len() {
        0 => Ok(views),
        1 => Err(errors.remove(0)),
        count => Err(Error::data(root, "", format!("{count} of {total} views cannot be used:{}", listed(&errors)))),
    }
}

/// Formats errors for the end of a message, one per line.
pub fn listed(errors: &[Error]) -> String {
    let lines: String = errors.iter().take(LISTED_MAX).map(|error| format!("\n  {error}")).collect();
    let more = errors.len().saturating_sub(LISTED_MAX);
    if more > 0 { format!("{lines}\n  and {more} more") } else { lines }
}
