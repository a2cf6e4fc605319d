//! The checkpoints of a run: `checkpoints/NUMBER-step-STEP.ckpt`. Numbers increase over all runs in a folder, so the
//! newest file is known without a clock, even after a restart from step 1.

use crate::error::{Error, Result};
use crate::files::read;
use std::path::{Path, PathBuf};

/// Name of the folder inside the folder of the run.
pub(crate) const CHECKPOINTS_FOLDER: &str = "checkpoints";
const CHECKPOINT_EXTENSION: &str = ".ckpt";

/// A checkpoint file, described by its name only.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct CheckpointFile {
    /// Number in the file name; larger is newer.
    pub number: u64,
    /// Step after which it was written.
    pub step: u32,
    /// Path of the file.
    pub path: PathBuf,
}

/// Lists the checkpoints in the folder of a run, the newest first; empty without the folder.
pub fn list(out: &Path) -> Result<Vec<CheckpointFile>> {
    let folder = out.join(CHECKPOINTS_FOLDER);
    let entries = match read::folder(&folder) {
        Err(Error::Read { source, .. }) if source.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
        other => other?,
    };
    let mut found: Vec<CheckpointFile> = entries.into_iter().filter_map(parse).collect();
    found.sort_unstable_by(|a, b| b.cmp(a));
    Ok(found)
}

fn parse(path: PathBuf) -> Option<CheckpointFile> {
    let (number, step) = path.file_name()?.to_str()?.strip_suffix(CHECKPOINT_EXTENSION)?.split_once("-step-")?;
    Some(CheckpointFile { number: number.parse().ok()?, step: step.parse().ok()?, path })
}

/// Returns the path for a new checkpoint.
pub fn next(out: &Path, step: u32) -> Result<PathBuf> {
    let newest = list(out)?.first().map_or(0, |found| found.number);
    Ok(out.join(CHECKPOINTS_FOLDER).join(format!("{}-step-{step}{CHECKPOINT_EXTENSION}", newest.saturating_add(1))))
}

/// Removes all checkpoints except `kept`. Leftovers are harmless, so failures are only logged.
pub fn keep(out: &Path, kept: &[PathBuf]) -> Result<()> {
    for found in list(out)?.into_iter().filter(|found| !kept.contains(&found.path)) {
        if let Err(error) = std::fs::remove_file(&found.path) {
            tracing::debug!("{}: not removed: {error}", found.path.display());
        }
    }
    Ok(())
}
