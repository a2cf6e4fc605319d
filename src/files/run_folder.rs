//! The folder of a training run, found from its model, and its lock.

use labelgs_scene::{Error, Result};
use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};

/// File with the settings of the run, in TOML.
pub const CONFIG: &str = "config.toml";
/// Name of the file with the exposures of the photos.
pub const EXPOSURES: &str = "exposures.json";
/// Name of the folder with the reconstruction of refined poses.
pub const REFINED: &str = "refined";
/// File that is locked while a run writes into the folder.
const LOCK: &str = ".labelgs-lock";

/// Returns the folder of the run that a model belongs to: `RUN` for `RUN` itself and for
/// `RUN/point_cloud/iteration_N/point_cloud.ply`; none for a PLY elsewhere.
pub fn of_model(model: &Path) -> Option<PathBuf> {
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

/// A lock on a folder, held until it is dropped or the process ends in any way. On file systems without locks it does
/// nothing.
#[derive(Debug)]
pub struct Lock {
    folder: PathBuf,
    #[cfg_attr(not(unix), expect(dead_code, reason = "it holds the lock"))]
    file: File,
}

impl Lock {
    /// Locks an existing folder. Fails if another process holds it.
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

    /// Keeps the lock; call it before each write. If the folder was deleted, makes and locks it again. Fails if another
    /// process was faster. A failure to make the folder shows in the next write.
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
        let [own, found] = [self.file.metadata(), std::fs::metadata(self.folder.join(LOCK))];
        let identity = |found: std::io::Result<std::fs::Metadata>| found.ok().map(|it| (it.dev(), it.ino()));
        identity(own) == identity(found)
    }

    /// Other systems do not delete open files.
    #[cfg(not(unix))]
    fn is_there(&self) -> bool {
        true
    }
}

fn is_taken(error: &Error) -> bool {
    matches!(error, Error::Write { source, .. } if source.kind() == std::io::ErrorKind::ResourceBusy)
}
