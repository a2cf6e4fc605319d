//! Compiled pipelines in a file per device: magic, checksum, length, and what the driver gave.

use super::atomic;
use crate::gpu::PipelineStore;
use crate::io::read;
use etcetera::base_strategy::{BaseStrategy, choose_native_strategy};
use std::path::PathBuf;

const MAGIC: [u8; 8] = *b"labelgsP";
const HEADER: usize = 20;

/// A folder of such files.
#[derive(Clone, Debug)]
pub struct PipelineFolder {
    folder: PathBuf,
}

impl PipelineFolder {
    /// A folder, made when something is saved.
    pub fn new(folder: impl Into<PathBuf>) -> Self {
        Self { folder: folder.into() }
    }

    /// `LABELGS_CACHE` if it names a folder, otherwise the user's cache folder; none with `off`, or where there is none.
    pub fn of_user() -> Option<Self> {
        match std::env::var_os("LABELGS_CACHE").filter(|value| !value.is_empty()) {
            Some(value) if value == "off" => None,
            Some(folder) => Some(Self::new(folder)),
            None => {
                let base = choose_native_strategy().ok()?.cache_dir();
                base.is_absolute().then(|| Self::new(base.join("labelgs")))
            }
        }
    }

    fn path(&self, device: &str) -> PathBuf {
        self.folder.join(format!("pipelines-{device}.bin"))
    }
}

impl PipelineStore for PipelineFolder {
    fn load(&self, device: &str) -> Vec<u8> {
        let path = self.path(device);
        let Ok(bytes) = read::bytes(&path) else { return Vec::new() };
        unpack(&bytes).map(<[u8]>::to_vec).unwrap_or_else(|| {
            tracing::warn!("{} is damaged; pipelines are compiled again and it is written anew", path.display());
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
            tracing::warn!("compiled pipelines were not kept, the next start compiles again: {error}");
        }
    }
}

/// The data, if it is whole: what a driver is given it may trust blindly.
fn unpack(bytes: &[u8]) -> Option<&[u8]> {
    let (header, data) = bytes.split_at_checked(HEADER)?;
    let (magic, rest) = header.split_at(MAGIC.len());
    let (sum, length) = rest.split_at(4);
    let whole =
        magic == MAGIC && length == (data.len() as u64).to_le_bytes() && sum == crc32fast::hash(data).to_le_bytes();
    whole.then_some(data)
}
