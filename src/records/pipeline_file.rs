//! The pipeline cache: one file per device with magic, checksum, length and the data of the driver.

use crate::files::{atomic, read};
use crate::gpu::PipelineStore;
use etcetera::base_strategy::{BaseStrategy, choose_native_strategy};
use std::path::PathBuf;

const MAGIC: [u8; 8] = *b"labelgsP";
const HEADER_BYTES: usize = 20;

/// A folder of pipeline caches.
#[derive(Clone, Debug)]
pub struct PipelineFolder {
    folder: PathBuf,
}

impl PipelineFolder {
    /// Uses a folder, which is created on the first save.
    pub fn new(folder: impl Into<PathBuf>) -> Self {
        Self { folder: folder.into() }
    }

    /// Uses the user's cache folder.
    pub fn for_user() -> Option<Self> {
        user_cache().map(Self::new)
    }

    /// Returns the folder for device locks: the user's cache folder, or else the system's temporary folder.
    pub fn locks_folder() -> PathBuf {
        Self::for_user().map_or_else(|| std::env::temp_dir().join("labelgs"), |cache| cache.folder)
    }

    fn path(&self, device: &str) -> PathBuf {
        self.folder.join(format!("pipelines-{device}.bin"))
    }
}

/// Returns the folder in `LABELGS_CACHE`, or else the user's cache folder; `None` for `off` or if there is no cache
/// folder.
pub(crate) fn user_cache() -> Option<PathBuf> {
    match std::env::var_os("LABELGS_CACHE").filter(|value| !value.is_empty()) {
        Some(value) if value == "off" => None,
        Some(folder) => Some(folder.into()),
        None => {
            let base = choose_native_strategy().ok()?.cache_dir();
            base.is_absolute().then(|| base.join("labelgs"))
        }
    }
}

impl PipelineStore for PipelineFolder {
    fn load(&self, device: &str) -> Vec<u8> {
        let path = self.path(device);
        let Ok(bytes) = read::bytes(&path) else { return Vec::new() };
        unpack(&bytes).map(<[u8]>::to_vec).unwrap_or_else(|| {
            tracing::warn!("{} is corrupt; pipelines are compiled and saved again", path.display());
            Vec::new()
        })
    }

    fn save(&self, device: &str, data: &[u8]) {
        let written = atomic::write(self.path(device), |file| {
            file.write_all(&MAGIC)?;
            file.write_all(&crc32fast::hash(data).to_le_bytes())?;
            file.write_all(&(data.len() as u64).to_le_bytes())?;
            file.write_all(data)
        });
        if let Err(error) = written {
            tracing::warn!(
                "compiled pipelines could not be saved and will be compiled again at the next start: {error}"
            );
        }
    }
}

/// Returns the data if it is intact: a driver may trust it without checks.
fn unpack(bytes: &[u8]) -> Option<&[u8]> {
    let (header, data) = bytes.split_at_checked(HEADER_BYTES)?;
    let (magic, rest) = header.split_at(MAGIC.len());
    let (sum, length) = rest.split_at(4);
    let whole =
        magic == MAGIC && length == (data.len() as u64).to_le_bytes() && sum == crc32fast::hash(data).to_le_bytes();
    whole.then_some(data)
}
