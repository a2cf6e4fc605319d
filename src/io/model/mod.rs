//! Model files, by extension. Every command reads and writes models here.
//!
//! To add a format, add a file beside `ply` with a `ModelFormat`, and an entry in `SHIPPED`. Other crates call
//! [`register`].

mod format;
mod ply;

use crate::error::{Error, Result};
use crate::io::atomic;
use crate::scene::Gaussians;
use std::path::Path;
use std::sync::{PoisonError, RwLock};

pub use format::{ModelFormat, ReadModel};

/// Formats of labelgs. The first one also serves unknown extensions, such as `/dev/stdout`.
const SHIPPED: [&ModelFormat; 1] = [&ply::FORMAT];

/// Formats that other crates have registered.
static REGISTERED: RwLock<Vec<&'static ModelFormat>> = RwLock::new(Vec::new());

/// Registers a format for all models from now on. It wins over earlier ones with the same extensions.
pub fn register(format: &'static ModelFormat) {
    REGISTERED.write().unwrap_or_else(PoisonError::into_inner).insert(0, format);
}

fn formats() -> Vec<&'static ModelFormat> {
    let mut all = REGISTERED.read().unwrap_or_else(PoisonError::into_inner).clone();
    all.extend(SHIPPED);
    all
}

/// Returns the format for the extension of a path, ignoring case.
fn by_ending(path: &Path) -> Option<&'static ModelFormat> {
    let name = path.file_name()?.to_string_lossy().to_lowercase();
    formats().into_iter().find(|format| format.endings.iter().any(|ending| name.ends_with(ending)))
}

/// Reads a model in the format of its extension. A file with an unknown extension is read as PLY; if that fails, the
/// error lists the known extensions.
pub fn read_model(path: impl AsRef<Path>) -> Result<ReadModel> {
    let path = path.as_ref();
    let Some(format) = by_ending(path) else {
        return (SHIPPED[0].read)(path).map_err(|error| with_endings(path, error));
    };
    let read = (format.read)(path)?;
    read.gaussians.check()?;
    Ok(read)
}

/// Adds the known extensions to the error of a file that was read as the first format by default.
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

/// Writes a model in the format of its extension; PLY if it is unknown. Leaves out rows that are not finite and returns
/// their number. The write is atomic.
pub fn write_model(path: impl AsRef<Path>, model: &Gaussians) -> Result<u64> {
    let path = path.as_ref();
    model.check()?;
    let finite: Vec<usize> = (0..model.len()).filter(|&row| model.is_finite(row)).collect();
    let format = by_ending(path).unwrap_or(SHIPPED[0]);
    atomic::write(path, |out| (format.write)(out, model, &finite))?;
    Ok((model.len() - finite.len()) as u64)
}
