//! Files of models, by the ending of their names. Every command reads and writes models here.
//!
//! A new format is a file beside [`ply`] with a [`ModelFormat`], and its line in [`SHIPPED`].

mod format;
mod ply;

use crate::error::{Error, Result};
use crate::io::atomic;
use crate::scene::Gaussians;
use std::path::Path;
use std::sync::{PoisonError, RwLock};

pub use format::{ModelFormat, ReadModel};

/// The formats of this program. The first is that of files whose ending belongs to no format, such as `/dev/stdout`.
const SHIPPED: [&ModelFormat; 1] = [&ply::FORMAT];

/// Formats of the programs that use this crate.
static REGISTERED: RwLock<Vec<&'static ModelFormat>> = RwLock::new(Vec::new());

/// Adds a format, for all models that are read and written from now on. It wins over others with its endings.
pub fn register(format: &'static ModelFormat) {
    REGISTERED.write().unwrap_or_else(PoisonError::into_inner).insert(0, format);
}

/// All formats, in the order in which they are asked.
fn formats() -> Vec<&'static ModelFormat> {
    let mut all = REGISTERED.read().unwrap_or_else(PoisonError::into_inner).clone();
    all.extend(SHIPPED);
    all
}

/// The format that a path names by its ending, in any case.
fn by_ending(path: &Path) -> Option<&'static ModelFormat> {
    let name = path.file_name()?.to_string_lossy().to_lowercase();
    formats().into_iter().find(|format| format.endings.iter().any(|ending| name.ends_with(ending)))
}

/// Reads a model in the format of its ending. A file whose ending belongs to no format may be a PLY all the same; if it
/// is none, the error names the endings that are known.
pub fn read_model(path: impl AsRef<Path>) -> Result<ReadModel> {
    let path = path.as_ref();
    let Some(format) = by_ending(path) else {
        return (SHIPPED[0].read)(path).map_err(|error| with_endings(path, error));
    };
    let read = (format.read)(path)?;
    read.gaussians.check()?;
    Ok(read)
}

/// The error of a file that was read as the first format for want of a better one.
fn with_endings(path: &Path, error: Error) -> Error {
    match (error, path.extension()) {
        (Error::Data { path, place, problem }, Some(ending)) => {
            let known: Vec<&str> = formats().into_iter().flat_map(|format| format.endings).copied().collect();
            let (ending, name, known) = (ending.display(), SHIPPED[0].name, known.join(", "));
            let problem = format!("{problem}; .{ending} was read as {name}, known endings of models are {known}");
            Error::Data { path, place, problem }
        }
        (error, _) => error,
    }
}

/// Writes a model in the format of its ending, a PLY where that belongs to no format. Rows that are not finite are left
/// out; returns how many. The file appears complete or not at all.
pub fn write_model(path: impl AsRef<Path>, model: &Gaussians) -> Result<u64> {
    let path = path.as_ref();
    model.check()?;
    let finite: Vec<usize> = (0..model.len()).filter(|&row| model.is_finite(row)).collect();
    let format = by_ending(path).unwrap_or(SHIPPED[0]);
    atomic::write(path, |out| (format.write)(out, model, &finite))?;
    Ok((model.len() - finite.len()) as u64)
}
