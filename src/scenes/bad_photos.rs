//! Undecodable photos: training can skip a few, but many mean a damaged data set.

use super::LoadOptions;
use labelgs_files::error_list::listed;
use labelgs_scene::{Error, Result, Setting};
use std::path::Path;

/// Returns how many of `total` photos may be skipped.
pub(super) fn allowed(max_share: f32, total: usize) -> usize {
    // In floating point, 0.29 of 100 is slightly less than 29.
    ((f64::from(max_share) * total as f64 + 1e-3) as usize).min(total.saturating_sub(1))
}

/// Notes the skipped photos, or refuses the scene with a list if they exceed the allowed share. `bad` has one error per
/// undecodable photo; `total` is the number of photos with a file.
pub fn skip(
    root: &Path,
    mut bad: Vec<Error>,
    total: usize,
    options: &LoadOptions,
    notes: &mut Vec<String>,
) -> Result<()> {
    if bad.is_empty() {
        return Ok(());
    }
    // A read error comes from the disk, not from the photo.
    if let Some(unread) = bad.iter().position(|error| matches!(error, Error::Read { .. })) {
        return Err(bad.swap_remove(unread));
    }
    let count = bad.len();
    let allowed = allowed(options.max_bad_photos, total);
    if count <= allowed {
        notes.push(format!("{count} of {total} photos cannot be read and are skipped:{}", listed(&bad)));
        return Ok(());
    }
    if count == 1 && total == 1 {
        return Err(bad.remove(0));
    }
    let problem = format!(
        "{count} of {total} photos cannot be read; {} allows {allowed}; repair them, remove them \
         of the scene, or allow more:{}",
        Setting("max_bad_photos").to(options.max_bad_photos),
        listed(&bad)
    );
    Err(Error::data(root, "photos", problem))
}
