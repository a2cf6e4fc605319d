//! The folder of a training run, found from its model.

use crate::error::{Error, Result};
use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};

/// Configuration of the run, in TOML.
pub const CONFIG: &str = "config.toml";
/// Locked while a run writes into the folder.
const LOCK: &str = ".labelgs-lock";

/// The folder of the run that a model is in: `RUN` for `RUN` itself and for
/// `RUN/point_cloud/iteration_N/point_cloud.ply`; none for a PLY elsewhere.
pub fn of_model(model: &Path) -> Option<PathBuf> {
    if model.is_dir() {
        return Some(model.to_owned());
    }
    // A relative path may start below the run.
    let model = std::path::absolute(model).ok()?;
    let step = model.parent()?;
    let models = step.parent()?;
    let is_step = step.file_name()?.to_str()?.starts_with("iteration_");
    (is_step && models.file_name()? == "point_cloud").then(|| models.parent().map(Path::to_owned)).flatten()
}

/// A folder that is this process's alone until this is dropped or the process ends, however it ends. Where the file system
/// knows no locks, nothing is locked.
#[derive(Debug)]
pub struct Lock {
    folder: PathBuf,
    file: File,
}

impl Lock {
    /// Locks a folder that is there. Fails if another process has it.
    pub fn take(folder: &Path) -> Result<Self> {
        let path = folder.join(LOCK);
        let file = File::options().create(true).append(true).open(&path).map_err(Error::write(&path))?;
        match file.try_lock() {
            Err(TryLockError::WouldBlock) => {
                let problem = "another labelgs trains into this folder; wait for it, or choose another folder";
                Err(Error::write(folder)(std::io::Error::new(std::io::ErrorKind::ResourceBusy, problem)))
            }
            Ok(()) | Err(TryLockError::Error(_)) => Ok(Self { folder: folder.to_owned(), file }),
        }
    }

    /// To be called before anything is written: if the folder was deleted, it is made and locked again. Fails if another
    /// process was faster; that the folder cannot be made is found by whatever writes into it.
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

    /// True while the path still leads to the file that is locked.
    #[cfg(unix)]
    fn is_there(&self) -> bool {
        use std::os::unix::fs::MetadataExt;
        let [own, found] = [self.file.metadata(), std::fs::metadata(self.folder.join(LOCK))];
        let identity = |found: std::io::Result<std::fs::Metadata>| found.ok().map(|it| (it.dev(), it.ino()));
        identity(own) == identity(found)
    }

    /// Elsewhere nobody deletes a file that is open.
    #[cfg(not(unix))]
    fn is_there(&self) -> bool {
        true
    }
}

fn is_taken(error: &Error) -> bool {
    matches!(error, Error::Write { source, .. } if source.kind() == std::io::ErrorKind::ResourceBusy)
}
