//! Model files, by extension. All commands read and write models through this crate.
//!
//! To add a format, add a file beside `ply` with a `ModelFormat`, and an entry in `MODEL_FORMATS`.

mod archive;
mod axis_signs;
mod format;
mod glb;
mod html;
mod lazy;
mod origin;
mod ply;
pub mod ply_table;
mod rows;
mod side_labels;
mod sog;
mod splat;
mod spz;
mod transform;
mod usd;
pub mod values;

use labelgs_files::label_table::LabelTable;
use labelgs_files::{atomic, content};
use labelgs_scene::stage::Stage;
use labelgs_scene::{Error, Gaussians, Result};
use std::path::Path;

pub use glb::{Mesh, write_meshes};
pub use lazy::{LazyModel, ModelRef};
pub use ply::StoredModel;
pub use ply::write_joined;
pub use rows::Row;
pub use transform::Transform;

pub use format::{Export, FirstView, LabelType, ReadModel, SpzVersion, WriteOptions};
pub use format::{ModelFormat, ModelWriter};

/// All formats. The first one is also used for pipes and devices, such as `/dev/stdout`.
const MODEL_FORMATS: [&ModelFormat; 8] = [
    &ply::MODEL_FORMAT,
    &spz::MODEL_FORMAT,
    &glb::MODEL_FORMAT,
    &sog::MODEL_FORMAT,
    &splat::MODEL_FORMAT,
    &html::MODEL_FORMAT,
    &usd::TEXT_FORMAT,
    &usd::PACKAGE_FORMAT,
];

/// Returns the format for a path's extension, ignoring case.
fn format_of(path: &Path) -> Option<&'static ModelFormat> {
    let name = path.file_name()?.to_string_lossy().to_lowercase();
    MODEL_FORMATS.into_iter().find(|format| format.extensions.iter().any(|extension| name.ends_with(extension)))
}

/// Returns the name and extension of each writable format.
pub fn formats() -> Vec<(&'static str, &'static str)> {
    MODEL_FORMATS
        .into_iter()
        .filter(|format| format.write.is_some())
        .map(|format| (format.name, format.extensions[0]))
        .collect()
}

/// Returns true if a model at this path is written as a page, which needs an initial view.
pub fn is_page(path: &Path) -> bool {
    format_of(path).is_some_and(|format| format.name == html::MODEL_FORMAT.name)
}

/// Lists the extensions of formats that are `chosen`.
fn extensions(chosen: impl Fn(&ModelFormat) -> bool) -> String {
    let all = MODEL_FORMATS.into_iter().filter(|format| chosen(format));
    all.flat_map(|format| format.extensions).copied().collect::<Vec<_>>().join(", ")
}

/// Returns the message for a path's unknown extension.
fn unknown_extension(path: &Path) -> String {
    let extension = path.extension().map(|extension| format!(".{}", extension.display()));
    extension.map_or("it has no extension".to_owned(), |extension| format!("{extension} is not a model extension"))
}

/// Returns the format for reading a path, by its extension. A file without one is identified by its first bytes; a pipe
/// is a PLY.
fn format_to_read(path: &Path) -> Result<&'static ModelFormat> {
    if let Some(format) = format_of(path) {
        return Ok(format);
    }
    if !path.exists() {
        return Err(Error::data(path, "", "there is no such file"));
    }
    if !path.is_file() {
        return Ok(MODEL_FORMATS[0]);
    }
    let content = content::identify_file(path)?;
    let own = |format: &&'static ModelFormat| content.is_some_and(|content| format.contents.contains(&content.what));
    if let Some(format) = MODEL_FORMATS.into_iter().find(own).filter(|_| path.extension().is_none()) {
        return Ok(format);
    }
    let problem = unknown_extension(path);
    let what = content.map_or(String::new(), |content| format!(" and the file {}", content.mismatch("a model")));
    let cure = "give the file the extension of its format, or export it in one of these";
    Err(Error::data(path, "", format!("{problem}{what}; {} are read: {cure}", extensions(|_| true))))
}

/// Returns the error of a reader, or what the file really is if its first bytes say so.
fn explained(path: &Path, format: &ModelFormat, error: Error) -> Error {
    let content = if path.is_file() { content::identify_file(path).ok().flatten() } else { None };
    match content.filter(|content| !format.contents.contains(&content.what)) {
        Some(content) => {
            Error::data(path, "byte 0", content.mismatch(&format!("a file of the format {}", format.name)))
        }
        None => error,
    }
}

/// Reads a model in the format of its extension; an unknown extension is an error.
pub fn read_model(path: impl AsRef<Path>) -> Result<ReadModel> {
    let path = path.as_ref();
    let _stage = Stage::new(format_args!("reading {}", path.display()), 0);
    let format = format_to_read(path)?;
    let read = (format.read)(path).map_err(|error| match error {
        Error::Data { .. } => explained(path, format, error),
        other => other,
    })?;
    read.gaussians.check()?;
    Ok(read)
}

/// Opens a model that can stay in its file, or returns `None` for one that must be read whole.
fn open_stored(path: &Path) -> Result<Option<StoredModel>> {
    if format_to_read(path)?.name == MODEL_FORMATS[0].name { StoredModel::open(path) } else { Ok(None) }
}

/// Returns the writer for a path's extension. An unknown one is an error; a pipe or device without one gets a PLY.
fn writer_for(path: &Path) -> Result<ModelWriter> {
    let is_pipe = || path.extension().is_none() && path.exists() && !path.is_file() && !path.is_dir();
    let format = format_of(path).or_else(|| is_pipe().then_some(MODEL_FORMATS[0]));
    let problem = match format {
        Some(ModelFormat { write: Some(writer), .. }) => return Ok(*writer),
        Some(format) => format!("{} files can only be read", format.name),
        None => unknown_extension(path),
    };
    let known = extensions(|format| format.write.is_some());
    Err(Error::usage(path.display().to_string(), format!("{problem}; models are written as {known}")))
}

/// Refuses a path whose extension has no writer.
pub fn check_output(path: &Path) -> Result<()> {
    writer_for(path).map(drop)
}

/// Writes a model in the format of its extension; an unknown extension is an error. Omits rows that are not finite and
/// returns their number. The write is atomic. Warns about data that the format cannot store.
pub fn write_model(path: impl AsRef<Path>, model: &Gaussians) -> Result<u64> {
    write(path.as_ref(), model, None, WriteOptions::default(), false)
}

/// Like [`write_model`], and also writes the label names: into the file if its format can store them, and to
/// `NAME.labels.json` beside it. Without names, removes an old names file.
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
    let writer = writer_for(path)?;
    let rows: Vec<usize> = (0..model.len()).filter(|&row| model.is_finite(row)).collect();
    let title = path.file_stem().unwrap_or_default().to_string_lossy();
    let export = Export { title: &title, ..Export::new(model, &rows, names, options) };
    (writer.losses)(&export)?.iter().for_each(|loss| tracing::warn!("{}: {loss}", path.display()));
    atomic::write(path, |out| (writer.write)(&export, out))?;
    // A pipe or device has no files beside it.
    if path.is_file() {
        origin::write(path, export.origin, rows.len() as u64)?;
    }
    if with_table {
        match (writer.checksum, export.labels()) {
            (Some(checksum), Some(labels)) => side_labels::write(path, &export, labels, checksum(&export))?,
            _ => LabelTable::write_or_remove(names, &LabelTable::path_beside(path))?,
        }
    }
    Ok((model.len() - rows.len()) as u64)
}
