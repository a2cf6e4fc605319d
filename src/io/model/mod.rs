//! Model files, by extension. Every command reads and writes models here.
//!
//! To add a format, add a file beside `ply` with a `ModelFormat`, and an entry in `SHIPPED`. Other crates call
//! [`register`].

mod format;
mod glb;
mod html;
mod lazy;
mod origin;
mod ply;
mod rows;
mod side_labels;
mod sog;
mod splat;
mod spz;
mod turn;
pub(crate) mod values;

use crate::error::{Error, Result};
use crate::io::atomic;
use crate::io::label_table::LabelTable;
use crate::scene::Gaussians;
use crate::stage::Stage;
use std::path::Path;
use std::sync::{PoisonError, RwLock};

pub use lazy::{LazyModel, ModelRef};
pub use ply::StoredModel;
pub(crate) use ply::write_joined;
pub(crate) use rows::Row;

pub use format::{Export, FirstView, LabelType, ModelFormat, ModelWriter, ReadModel, SpzVersion, WriteOptions};

/// Formats of labelgs. The first one also serves unknown extensions, such as `/dev/stdout`.
const SHIPPED: [&ModelFormat; 6] =
    [&ply::FORMAT, &spz::FORMAT, &glb::FORMAT, &sog::FORMAT, &splat::FORMAT, &html::FORMAT];

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

/// Returns true if a model at this path is written as a page, which shows it from somewhere at first.
pub(crate) fn is_page(path: &Path) -> bool {
    by_ending(path).is_some_and(|format| format.name == html::FORMAT.name)
}

/// Reads a model in the format of its extension. A file with an unknown extension is read as PLY; if that fails, the
/// error lists the known extensions.
pub fn read_model(path: impl AsRef<Path>) -> Result<ReadModel> {
    let path = path.as_ref();
    let _stage = Stage::new(format_args!("reading {}", path.display()), 0);
    let Some(format) = by_ending(path) else {
        return (SHIPPED[0].read)(path).map_err(|error| with_endings(path, error));
    };
    let read = (format.read)(path)?;
    read.gaussians.check()?;
    Ok(read)
}

/// Opens a model that can stay in its file, or returns `None` for one that is read whole.
fn open_stored(path: &Path) -> Result<Option<StoredModel>> {
    match by_ending(path) {
        Some(format) if format.name == SHIPPED[0].name => StoredModel::open(path),
        Some(_) => Ok(None),
        // Reading it whole tells what is wrong with a file of an unknown ending.
        None => StoredModel::open(path).or(Ok(None)),
    }
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
/// their number. The write is atomic. What the format cannot hold is logged as a warning.
pub fn write_model(path: impl AsRef<Path>, model: &Gaussians) -> Result<u64> {
    write(path.as_ref(), model, None, WriteOptions::default(), false)
}

/// Like [`write_model`], with the names of the labels: in the file, where its format has a place for them, and in
/// `NAME.labels.json` beside it. Without names, an old file of names beside it is removed.
pub fn export_model(
    path: impl AsRef<Path>,
    model: &Gaussians,
    names: Option<&LabelTable>,
    options: WriteOptions,
) -> Result<u64> {
    let names = names.filter(|_| options.label_type != LabelType::None);
    write(path.as_ref(), model, names, options, true)
}

fn write(
    path: &Path,
    model: &Gaussians,
    names: Option<&LabelTable>,
    options: WriteOptions,
    with_table: bool,
) -> Result<u64> {
    let _stage = Stage::new(format_args!("writing {}", path.display()), 0);
    model.check()?;
    let format = by_ending(path).unwrap_or(SHIPPED[0]);
    let Some(writer) = format.write else {
        let all = formats().into_iter().filter(|format| format.write.is_some());
        let known: Vec<&str> = all.flat_map(|format| format.endings).copied().collect();
        let problem =
            format!("{} files are only read; formats that are written end in {}", format.name, known.join(", "));
        return Err(Error::usage(path.display().to_string(), problem));
    };
    let rows: Vec<usize> = (0..model.len()).filter(|&row| model.is_finite(row)).collect();
    let export = Export::new(model, &rows, names, options);
    (writer.losses)(&export)?.iter().for_each(|loss| tracing::warn!("{}: {loss}", path.display()));
    atomic::write(path, |out| (writer.write)(&export, out))?;
    // A pipe or a device has no files beside it.
    if path.is_file() {
        origin::write(path, export.origin, rows.len() as u64)?;
    }
    if with_table {
        match (writer.checksum, export.labels()) {
            (Some(checksum), Some(labels)) => side_labels::write(path, &export, labels, checksum(&export))?,
            _ => LabelTable::put(names, &LabelTable::beside(path))?,
        }
    }
    Ok((model.len() - rows.len()) as u64)
}
