//! `labelgs train`.

use super::Context;
use super::train_args::TrainArgs;
use crate::{Error, Result};

/// Trains a model.
pub fn run(_args: &TrainArgs, _context: &Context) -> Result<()> {
    Err(Error::Bug("not built yet".into()))
}
