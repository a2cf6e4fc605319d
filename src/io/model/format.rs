//! What a kind of model file must be able to do.

use crate::error::Result;
use crate::scene::Gaussians;
use std::io::{self, Write};
use std::path::Path;

/// A model as a file holds it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReadModel {
    /// The usable Gaussians.
    pub gaussians: Gaussians,
    /// Gaussians left out because they cannot be rendered.
    pub dropped: u64,
    /// What a person should know about the file, a line each.
    pub notes: Vec<String>,
}

/// A kind of model file.
#[derive(Clone, Copy, Debug)]
pub struct ModelFormat {
    /// What it is called.
    pub name: &'static str,
    /// How names of its files end: lower case, with the dot.
    pub endings: &'static [&'static str],
    /// Reads a file. Its path is for messages and for [`crate::io::read`], through which all files are opened.
    pub read: fn(&Path) -> Result<ReadModel>,
    /// Writes these rows, all of which are finite, of a model whose columns agree in length.
    pub write: fn(&mut dyn Write, &Gaussians, &[usize]) -> io::Result<()>,
}
