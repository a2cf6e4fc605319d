//! One error for many files.

use labelgs_scene::{Error, Result};
use std::path::Path;

/// Most problems that one message lists.
pub const LISTED_MAX: usize = 20;

/// Returns the loaded views, or one error that lists all failures.
pub fn all_or_one_error<T>(root: &Path, loaded: Vec<Result<T>>) -> Result<Vec<T>> {
    let total = loaded.len();
    let mut views = Vec::with_capacity(total);
    let mut errors = Vec::new();
    for view in loaded {
        match view {
            Ok(view) => views.push(view),
            Err(error) => errors.push(error),
        }
    }
    match errors.len() {
        0 => Ok(views),
        1 => Err(errors.remove(0)),
        count => {
            let shown: Vec<String> = errors.iter().take(LISTED_MAX).map(ToString::to_string).collect();
            let more = if count > LISTED_MAX { format!("\n  and {} more", count - LISTED_MAX) } else { String::new() };
            let problem = format!("{count} of {total} views cannot be used:\n  {}{more}", shown.join("\n  "));
            Err(Error::data(root, "", problem))
        }
    }
}
