//! Locks on devices, by which processes that may use several devices share them out.

use super::capabilities::Capabilities;
use crate::error::{Error, Result};
use std::collections::BTreeMap;
use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, Weak};

/// A lock on a device, held until the last clone is dropped or the process ends in any way.
pub(super) type DeviceLock = Arc<File>;

/// Locks of this process: a device that it opens again, such as a lost one, is its own.
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

/// The file of a device. It stays when the lock is gone: a file that is deleted while others open it would be locked
/// twice.
fn path(folder: &Path, device: &Capabilities) -> PathBuf {
    folder.join(format!("device-{}.lock", device.uuid_text()))
}
