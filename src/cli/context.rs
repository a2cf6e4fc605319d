//! What every verb is given, and how it opens a model.

use super::args::GlobalArgs;
use crate::Result;
use crate::scene::Gaussians;
use std::path::Path;

/// What every verb gets besides its own arguments.
#[derive(Clone, Debug, Default)]
pub struct Context {
    /// `-q`, `-v` and `--device`.
    pub global: GlobalArgs,
    /// `--json` before the verb.
    pub json: bool,
}

/// Reads a model, or the last one in the folder of a run, and logs what a person should know about the file.
pub fn open_model(path: &Path) -> Result<Gaussians> {
    let path = &if path.is_dir() { crate::train::record::latest_model(path)? } else { path.to_owned() };
    let read = crate::io::ply::read_gaussians(path)?;
    read.notes.iter().for_each(|note| tracing::warn!("{}: {note}", path.display()));
    Ok(read.gaussians)
}
