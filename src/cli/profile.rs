//! `labelgs profile`.

use super::Context;
use super::args::ProfileArgs;
use crate::{Error, Result};

/// Times steps.
pub fn run(_args: &ProfileArgs, _context: &Context) -> Result<()> {
    Err(Error::Bug("not built yet".into()))
}
