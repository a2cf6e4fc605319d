//! `labelgs render`.

use super::Context;
use super::args::RenderArgs;
use crate::{Error, Result};

/// Renders views.
pub fn run(_args: &RenderArgs, _context: &Context) -> Result<()> {
    Err(Error::Bug("not built yet".into()))
}
