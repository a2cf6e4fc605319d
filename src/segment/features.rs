//! The features of a photo from the encoder, in memory and on disk.

use super::network::Network;
use half::f16;
use labelgs_files::{atomic, read};
use labelgs_scene::{Photo, Result};
use safetensors::tensor::{Dtype, SafeTensors, TensorView};
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// Most bytes of features on disk, over all networks: two thousand photos of MobileSAM.
const BYTES_MAX: u64 = 4 << 30;
/// Prefix of the folders, one for each network.
const FOLDER_PREFIX: &str = "features-";

/// The features of a photo in 16 bits, so that they are the same whether fresh or read from disk.
#[derive(Clone, Debug, PartialEq)]
pub struct Features {
    /// Width and height of the photo, px.
    pub photo: (u32, u32),
    tensors: Vec<(Vec<usize>, Vec<f16>)>,
}

impl Features {
    pub(crate) fn new(photo: (u32, u32), tensors: Vec<(Vec<usize>, Vec<f32>)>) -> Self {
        let halves = |values: Vec<f32>| values.into_iter().map(f16::from_f32).collect();
        Self { photo, tensors: tensors.into_iter().map(|(shape, values)| (shape, halves(values))).collect() }
    }

    pub(crate) fn finite(&self) -> bool {
        self.tensors.iter().all(|(_, values)| values.iter().all(|value| value.is_finite()))
    }

    /// Returns the shapes and values.
    pub(crate) fn tensors(&self) -> impl Iterator<Item = (&[usize], Vec<f32>)> {
        self.tensors
            .iter()
            .map(|(shape, values)| (shape.as_slice(), values.iter().map(|value| value.to_f32()).collect()))
    }

    /// Reads features that [`Features::write`] wrote; `None` if they are missing or unreadable.
    pub fn read(path: &Path, photo: (u32, u32)) -> Option<Self> {
        let bytes = read::bytes(path).ok()?;
        let file = SafeTensors::deserialize(&bytes).ok()?;
        let tensor = |at: usize| {
            let tensor = file.tensor(&at.to_string()).ok().filter(|tensor| tensor.dtype() == Dtype::F16)?;
            let values = tensor.data().chunks_exact(2).map(|two| f16::from_le_bytes([two[0], two[1]]));
            Some((tensor.shape().to_vec(), values.collect()))
        };
        let tensors: Vec<_> = (0..file.len()).map(tensor).collect::<Option<_>>()?;
        Some(Self { photo, tensors }).filter(|features| !features.tensors.is_empty() && features.finite())
    }

    /// Writes the features.
    pub fn write(&self, path: &Path) -> Result<()> {
        let data: Vec<Vec<u8>> = self
            .tensors
            .iter()
            .map(|(_, values)| values.iter().flat_map(|value| value.to_le_bytes()).collect())
            .collect();
        let views = self.tensors.iter().zip(&data).enumerate().map(|(at, ((shape, _), bytes))| {
            let view =
                TensorView::new(Dtype::F16, shape.clone(), bytes).expect("shape and length come from one tensor");
            (at.to_string(), view)
        });
        let bytes = safetensors::serialize(views.collect::<Vec<_>>(), None).expect("names differ, lengths fit");
        atomic::write(path, |file| file.write_all(&bytes))
    }
}

/// Returns a hash of file content.
pub fn digest(bytes: &[u8]) -> u64 {
    let half = bytes.len() / 2;
    let (first, second) = (crc32fast::hash(bytes), crc32fast::hash(&bytes[half..]));
    (u64::from(first) << 32 | u64::from(second)) ^ bytes.len() as u64
}

/// Features on disk, for one network.
#[derive(Clone, Debug)]
pub struct FeatureCache {
    folder: Option<PathBuf>,
    bytes_max: u64,
}

impl FeatureCache {
    /// Uses a folder, which is created on the first write; `None` disables the cache. If the features of all networks
    /// in the folder exceed 4 GiB, the least recently used ones are deleted.
    pub fn new(folder: Option<&Path>, network: &Network) -> Self {
        let folder = folder.map(|folder| folder.join(format!("{FOLDER_PREFIX}{}", network.digest)));
        Self { folder, bytes_max: BYTES_MAX }
    }

    /// Sets the size limit of the cache, bytes.
    pub fn bounded(self, bytes_max: u64) -> Self {
        Self { bytes_max, ..self }
    }

    /// Returns the file for a photo's features if the cache has a folder.
    fn file(&self, photo: &Photo) -> Option<PathBuf> {
        let digest = digest(photo.rgba.as_flattened());
        Some(self.folder.as_ref()?.join(format!("{digest:016x}-{}x{}.safetensors", photo.width, photo.height)))
    }

    /// Returns true if the features of a photo are on disk.
    pub fn holds(&self, photo: &Photo) -> bool {
        self.file(photo).is_some_and(|path| path.is_file())
    }

    /// Returns the features of a photo from disk, or computes and stores them.
    pub fn features(&self, network: &Network, photo: &Photo) -> Result<Features> {
        let Some(path) = self.file(photo) else { return network.encode(photo) };
        if let Some(found) = Features::read(&path, (photo.width, photo.height)) {
            // If a file cannot be marked as used, it is deleted sooner.
            let _ = File::options().append(true).open(&path).and_then(|file| file.set_modified(SystemTime::now()));
            return Ok(found);
        }
        let features = network.encode(photo)?;
        features.write(&path)?;
        if let Some(folder) = self.folder.as_deref().and_then(Path::parent) {
            bound(folder, self.bytes_max, &path);
        }
        Ok(features)
    }
}

/// Deletes the least recently used features, except `newest`, until the rest takes at most `bytes_max`. Ignores files
/// that cannot be listed or deleted, because other processes share the folder.
fn bound(folder: &Path, bytes_max: u64, newest: &Path) {
    let of_network =
        |path: &PathBuf| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(FOLDER_PREFIX));
    let networks = read::folder(folder).unwrap_or_default().into_iter().filter(of_network);
    let files = networks.flat_map(|network| read::folder(&network).unwrap_or_default());
    let mut used: Vec<(SystemTime, u64, PathBuf)> = files
        .filter_map(|path| {
            let found = fs::metadata(&path).ok()?;
            Some((found.modified().ok()?, found.len(), path))
        })
        .collect();
    used.sort_unstable();
    let mut bytes: u64 = used.iter().map(|(_, bytes, _)| bytes).sum();
    for (_, of_file, path) in used.iter().filter(|(.., path)| path != newest) {
        if bytes <= bytes_max {
            return;
        }
        if fs::remove_file(path).is_ok() {
            bytes -= of_file;
        }
    }
}
