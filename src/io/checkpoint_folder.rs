//! The checkpoints of a run: `checkpoints/NUMBER-step-STEP.ckpt`. Numbers count up over all runs in a folder, so that the
//! newest is found without a clock, also where a run was started anew at step 1.

use crate::error::{Error, Result};
use crate::io::read;
use std::path::{Path, PathBuf};

/// Name of the folder in that of a run.
pub(crate) const FOLDER: &str = "checkpoints";
const EXTENSION: &str = ".ckpt";

/// A file by its name; what it holds was not looked at.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Found {
    /// Number, larger for newer ones.
    pub number: u64,
    /// Step after which it was written.
    pub step: u32,
    /// The file.
    pub path: PathBuf,
}

/// The checkpoints in the folder of a run, the newest first; none if there is no such folder.
pub fn list(out: &Path) -> Result<Vec<Found>> {
    let folder = out.join(FOLDER);
    let entries = match read::folder(&folder) {
        Err(Error::Read { source, .. }) if source.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
        other => other?,
    };
    let mut found: Vec<Found> = entries.into_iter().filter_map(parse).collect();
    found.sort_unstable_by(|a, b| b.cmp(a));
    Ok(found)
}

fn parse(path: PathBuf) -> Option<Found> {
    let (number, step) = path.file_name()?.to_str()?.strip_suffix(EXTENSION)?.split_once("-step-")?;
    Some(Found { number: number.parse().ok()?, step: step.parse().ok()?, path })
}

/// The path of a new checkpoint.
pub fn next(out: &Path, step: u32) -> Result<PathBuf> {
    let newest = list(out)?.first().map_or(0, |found| found.number);
    Ok(out.join(FOLDER).join(format!("{}-step-{step}{EXTENSION}", newest.saturating_add(1))))
}

/// Removes all but `kept`; one that cannot be removed is in nobody's way, and stays.
pub fn keep(out: &Path, kept: &[PathBuf]) -> Result<()> {
    for found in list(out)?.into_iter().filter(|found| !kept.contains(&found.path)) {
        if let Err(error) = std::fs::remove_file(&found.path) {
            tracing::debug!("{}: not removed: {error}", found.path.display());
        }
    }
    Ok(())
}
