//! Steps.

use super::Common;
use labelgs::Result;

/// Runs it.
pub fn run(_common: &Common) -> Result<()> {
    let gpu = super::device::open()?;
    println!("{}", gpu.capabilities().name);
    Ok(())
}
