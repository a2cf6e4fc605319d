//! `labelgs devices`.

use super::Context;
use super::args::DevicesArgs;
use crate::{Error, Result};

/// Prints the devices.
pub fn run(_args: &DevicesArgs, _context: &Context) -> Result<()> {
    Err(Error::Bug("not built yet".into()))
}
