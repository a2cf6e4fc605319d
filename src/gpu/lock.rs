//! Device locks, so that processes started with a list of devices each take a different one.

use super::capabilities::Capabilities;
use crate::error::{Error, Result};
use std::collections::BTreeMap;
use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, Weak};

/// A lock on a device, held until the last clone is dropped or the process ends, even by a crash.
pub(super) type DeviceLock = Arc<File>;

/// Locks held by this process, which may reopen its own device, for example after losing it.
static PROCESS_LOCKS: Mutex<BTreeMap<PathBuf, Weak<File>>> = Mutex::new(BTreeMap::new());

/// Locks a device; `None` if another process holds it.
pub(super) fn take(folder: &Path, device: &Capabilities) -> Result<Option<DeviceLock>> {
    let path = path(folder, device);
    let mut own = super::lock(&PROCESS_LOCKS);
    if let Some(lock) = own.get(&path).and_then(Weak::upgrade) {
        return Ok(Some(lock));
    }
    std::fs::create_dir_all(folder).map_err(Error::write(folder))?;
    let file = File::options().create(true).append(true).open(&path).map_err(Error::write(&path))?;
    match file.try_lock() {
        Ok(()) => {
            let lock = Arc::new(file);
            own.insert(path, Arc::downgrade(&lock));
            Ok(Some(lock))
        }
        Err(TryLockError::WouldBlock) => Ok(None),
        Err(TryLockError::Error(error)) => Err(Error::write(path)(error)),
    }
}

/// The lock file of a device. It is never deleted: two processes could otherwise lock the old and the new file.
fn path(folder: &Path, device: &Capabilities) -> PathBuf {
    folder.join(format!("device-{}.lock", device.uuid_text()))
}
