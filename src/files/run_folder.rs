//! Finds the folder of a training run from its model, and locks it.

use labelgs_scene::{Error, Result};
use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};

/// TOML file with the settings of the run.
pub const CONFIG_FILE: &str = "config.toml";
/// File with the exposures of the photos.
pub const EXPOSURES_FILE: &str = "exposures.json";
/// Folder with the refined poses as a COLMAP model.
pub const REFINED_FOLDER: &str = "refined";
/// File that is locked while a run writes to the folder.
const LOCK_FILE: &str = ".labelgs-lock";

/// Returns the run folder of a model: `RUN` for `RUN` itself and for `RUN/point_cloud/iteration_N/point_cloud.ply`,
/// `None` for a PLY elsewhere.
pub fn find_for_model(model: &Path) -> Option<PathBuf> {
    if model.is_dir() {
        return Some(model.to_owned());
    }
    // The run may be above the start of a relative path.
    let model = std::path::absolute(model).ok()?;
    let step = model.parent()?;
    let models = step.parent()?;
    let is_step = step.file_name()?.to_str()?.starts_with("iteration_");
    (is_step && models.file_name()? == "point_cloud").then(|| models.parent().map(Path::to_owned)).flatten()
}

/// A lock on a folder, held until the value is dropped or the process ends in any way. It has no effect on file systems
/// without locks.
#[derive(Debug)]
pub struct Lock {
    folder: PathBuf,
    #[cfg_attr(not(unix), expect(dead_code, reason = "it holds the lock"))]
    file: File,
}

impl Lock {
    /// Locks an existing folder. Fails if another process holds it.
    pub fn take(folder: &Path) -> Result<Self> {
        let path = folder.join(LOCK_FILE);
        let file = File::options().create(true).append(true).open(&path).map_err(Error::write(&path))?;
        match file.try_lock() {
            Err(TryLockError::WouldBlock) => {
                let problem = "another labelgs process trains into this folder; wait for it, or choose another folder";
                Err(Error::write(folder)(std::io::Error::new(std::io::ErrorKind::ResourceBusy, problem)))
            }
            Ok(()) | Err(TryLockError::Error(_)) => Ok(Self { folder: folder.to_owned(), file }),
        }
    }

    /// Keeps the lock; call this before each write. If the folder was deleted, recreates and locks it. Fails if another
    /// process was faster. If the folder cannot be created, the next write fails.
    pub fn hold(&mut self) -> Result<()> {
        if self.is_there() || std::fs::create_dir_all(&self.folder).is_err() {
            return Ok(());
        }
        match Self::take(&self.folder) {
            Ok(again) => *self = again,
            Err(error) if is_taken(&error) => return Err(error),
            Err(_) => {}
        }
        Ok(())
    }

    /// Returns true while the path leads to the locked file.
    #[cfg(unix)]
    fn is_there(&self) -> bool {
        use std::os::unix::fs::MetadataExt;
        let [own, found] = [self.file.metadata(), std::fs::metadata(self.folder.join(LOCK_FILE))];
        let identity = |found: std::io::Result<std::fs::Metadata>| found.ok().map(|it| (it.dev(), it.ino()));
        identity(own) == identity(found)
    }

    /// Other systems refuse to delete open files.
    #[cfg(not(unix))]
    fn is_there(&self) -> bool {
        true
    }
}

fn is_taken(error: &Error) -> bool {
    matches!(error, Error::Write { source, .. } if source.kind() == std::io::ErrorKind::ResourceBusy)
}
