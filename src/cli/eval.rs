//! `labelgs eval`.

use super::Context;
use super::args::EvalArgs;
use crate::{Error, Result};

/// Scores a model.
pub fn run(_args: &EvalArgs, _context: &Context) -> Result<()> {
    Err(Error::Bug("not built yet".into()))
}
