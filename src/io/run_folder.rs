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

/// Makes the folder this process's alone until the result is dropped or the process ends, however it ends. Where the
/// file system knows no locks, nothing is locked.
pub fn lock(folder: &Path) -> Result<File> {
    let path = folder.join(LOCK);
    let file = File::options().create(true).append(true).open(&path).map_err(Error::write(&path))?;
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => {
            let problem = "another labelgs trains into this folder; wait for it, or name another folder with -o";
            Err(Error::write(folder)(std::io::Error::new(std::io::ErrorKind::ResourceBusy, problem)))
        }
        Ok(()) | Err(TryLockError::Error(_)) => Ok(file),
    }
}
