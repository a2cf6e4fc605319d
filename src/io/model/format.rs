//! The interface of model file formats.

use crate::error::Result;
use crate::scene::Gaussians;
use std::io::{self, Write};
use std::path::Path;

/// The content of a model file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReadModel {
    /// The usable Gaussians.
    pub gaussians: Gaussians,
    /// Number of Gaussians left out because they cannot be rendered.
    pub dropped: u64,
    /// Notes for the user, a line each.
    pub notes: Vec<String>,
}

/// A model file format.
#[derive(Clone, Copy, Debug)]
pub struct ModelFormat {
    /// Display name.
    pub name: &'static str,
    /// Extensions of its files: lower case, with the dot.
    pub endings: &'static [&'static str],
    /// Reads a file, through `crate::io::read`.
    pub read: fn(&Path) -> Result<ReadModel>,
    /// Writes the rows with these indices, all finite, of a model whose columns have equal lengths.
    pub write: fn(&mut dyn Write, &Gaussians, &[usize]) -> io::Result<()>,
}
