//! `labelgs plan`.

use super::Context;
use super::args::PlanArgs;
use crate::{Error, Result};

/// Prints the plan of a step.
pub fn run(_args: &PlanArgs, _context: &Context) -> Result<()> {
    Err(Error::Bug("not built yet".into()))
}
