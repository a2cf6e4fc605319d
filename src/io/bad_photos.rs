//! Photos that are there and cannot be decoded: a few may be missing from a training, many are a damaged data set.

use super::LoadOptions;
use crate::error::{Error, Result};
use std::path::Path;

/// Most problems that one message lists.
pub(crate) const LISTED_MAX: usize = 20;

/// Notes the photos that are skipped, or refuses the scene, with a list, if they are more than the options allow.
/// `bad` is why each of them, of `total` photos that there are files of, cannot be decoded.
pub(crate) fn skip(
    root: &Path,
    mut bad: Vec<Error>,
    total: usize,
    options: &LoadOptions,
    notes: &mut Vec<String>,
) -> Result<()> {
    if bad.is_empty() {
        return Ok(());
    }
    // Whatever a disk that fails holds, it is not the photo that is bad.
    if let Some(unread) = bad.iter().position(|error| matches!(error, Error::Read { .. })) {
        return Err(bad.swap_remove(unread));
    }
    let count = bad.len();
    let listed = || bad.iter().take(LISTED_MAX).map(|error| format!("\n  {error}")).collect::<String>();
    let more = if count > LISTED_MAX { format!("\n  and {} more", count - LISTED_MAX) } else { String::new() };
    // A share of 0.29 is a little less than 29 of 100.
    let allowed = ((f64::from(options.max_bad_photos) * total as f64 + 1e-3) as usize).min(total.saturating_sub(1));
    if count <= allowed {
        notes.push(format!("{count} of {total} photos cannot be decoded and are skipped:{}{more}", listed()));
        return Ok(());
    }
    if count == 1 && total == 1 {
        return Err(bad.remove(0));
    }
    let problem = format!(
        "{count} of {total} photos cannot be decoded, `max_bad_photos = {}` allows {allowed}; write them anew, take them out \
         of the scene, or allow more:{}{more}",
        options.max_bad_photos,
        listed()
    );
    Err(Error::data(root, "photos", problem))
}
