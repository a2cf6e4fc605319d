//! The binary files: little-endian, fixed widths, counts first. No memory is allocated from a count alone.

use super::model::{CameraRecord, ImageRecord, unknown_model};
use crate::lens;
use glam::{DVec2, DVec3};
use labelgs_files::read;
use labelgs_scene::{Error, Point, Result};
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

/// Most bytes in an image's file name.
const NAME_MAX: u64 = 4096;

/// A file that is read sequentially, with its position.
struct BinaryReader {
    path: PathBuf,
    file: BufReader<read::Source>,
    length: u64,
    at: u64,
    /// Kind, number from 1 and total count of the current record.
    record: (&'static str, u64, u64),
}

impl BinaryReader {
    fn open(path: &Path) -> Result<Self> {
        let file = read::open(path)?;
        let length = file.get_ref().length().map_err(Error::read(path))?;
        Ok(Self { path: path.to_owned(), file, length, at: 0, record: ("record", 0, 0) })
    }

    fn error(&self, problem: impl Into<String>) -> Error {
        let (kind, number, count) = self.record;
        Error::data(&self.path, format!("byte {}, {kind} {number} of {count}", self.at), problem)
    }

    fn bytes<const N: usize>(&mut self) -> Result<[u8; N]> {
        if self.length - self.at.min(self.length) < N as u64 {
            return Err(self.error(format!("the file ends here after {} bytes; it was cut short", self.length)));
        }
        let mut bytes = [0; N];
        self.file.read_exact(&mut bytes).map_err(Error::read(&self.path))?;
        self.at += N as u64;
        Ok(bytes)
    }

    fn u32(&mut self) -> Result<u32> {
        Ok(u32::from_le_bytes(self.bytes()?))
    }

    fn u64(&mut self) -> Result<u64> {
        Ok(u64::from_le_bytes(self.bytes()?))
    }

    fn f64(&mut self) -> Result<f64> {
        Ok(f64::from_le_bytes(self.bytes()?))
    }

    fn f64s<const N: usize>(&mut self) -> Result<[f64; N]> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = self.f64()?;
        }
        Ok(values)
    }

    fn skip(&mut self, count: u64, size: u64, what: &str) -> Result<()> {
        let left = self.length - self.at.min(self.length);
        let bytes = u128::from(count) * u128::from(size);
        if bytes > u128::from(left) {
            return Err(self.error(format!("{count} {what} take {bytes} bytes; only {left} are left: damaged file")));
        }
        self.file.seek_relative(bytes as i64).map_err(Error::read(&self.path))?;
        self.at += bytes as u64;
        Ok(())
    }

    fn name(&mut self) -> Result<String> {
        let mut bytes = Vec::new();
        (&mut self.file).take(NAME_MAX).read_until(0, &mut bytes).map_err(Error::read(&self.path))?;
        if bytes.pop() != Some(0) {
            return Err(self.error(format!("an image name does not end within {NAME_MAX} bytes")));
        }
        let name = String::from_utf8(bytes).map_err(|_| self.error("an image name is not UTF-8"))?;
        self.at += name.len() as u64 + 1;
        Ok(name)
    }

    /// Reads the leading count, then calls `record` for each record.
    fn records<T>(mut self, kind: &'static str, mut record: impl FnMut(&mut Self) -> Result<T>) -> Result<Vec<T>> {
        let count = self.u64()?;
        let mut all = Vec::new();
        for index in 0..count {
            self.record = (kind, index + 1, count);
            all.push(record(&mut self)?);
        }
        Ok(all)
    }
}

pub(super) fn cameras(path: &Path) -> Result<Vec<CameraRecord>> {
    BinaryReader::open(path)?.records("camera", |source| {
        let (id, number) = (source.u32()?, source.u32()?);
        let (width, height) = (source.u64()?, source.u64()?);
        let Some(model) = lens::colmap_model(number as usize) else {
            return Err(unknown_model(path, format!("byte {}, camera {id}", source.at), &number));
        };
        let parameters = (0..model.before() + model.coefficients).map(|_| source.f64()).collect::<Result<_>>()?;
        Ok(CameraRecord { id, model, width, height, parameters })
    })
}

/// Returns the number of records of a file.
pub(super) fn count(path: &Path) -> Result<u64> {
    BinaryReader::open(path)?.u64()
}

/// Reads `images.bin`, with the observations of points on request.
pub(super) fn images(path: &Path, with_observations: bool) -> Result<Vec<ImageRecord>> {
    BinaryReader::open(path)?.records("image", |source| {
        let id = source.u32()?;
        let (quaternion, translation) = (source.f64s()?, source.f64s()?);
        let (camera, name) = (source.u32()?, source.name()?);
        let observations = source.u64()?;
        let mut observed = Vec::new();
        if with_observations {
            for _ in 0..observations {
                let (pixel, point) = (DVec2::from_array(source.f64s()?), source.u64()?);
                // All bits set: an image feature without a point.
                if point != u64::MAX {
                    observed.push((pixel, point));
                }
            }
        } else {
            source.skip(observations, 24, "observations")?;
        }
        Ok(ImageRecord { id, quaternion, translation, camera, name, observed })
    })
}

/// Reads `points3D.bin` with the ids, without the tracks.
pub(super) fn points(path: &Path) -> Result<Vec<(u64, Point)>> {
    BinaryReader::open(path)?.records("point", |source| {
        let id = source.u64()?;
        let position = DVec3::from_array(source.f64s()?);
        let colour = source.bytes()?;
        source.f64()?;
        let track = source.u64()?;
        source.skip(track, 8, "track elements")?;
        Ok((id, Point { position, colour }))
    })
}
