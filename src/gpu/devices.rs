//! The list of devices.

use super::GpuOptions;
use super::capabilities::Capabilities;
use super::instance::{Instance, Validation};
use super::select;
use crate::error::Result;

/// Lists all devices, and the position of the one that [`Gpu::new`](super::Gpu::new) picks with these options, or the
/// error with which it fails.
pub fn devices(options: &GpuOptions) -> Result<(Vec<Capabilities>, Result<usize>)> {
    let instance = Instance::new(Validation::Off)?;
    let mut found: Vec<Capabilities> = select::all(&instance)?.into_iter().map(|(_, device)| device).collect();
    let picked = select::pick(&instance, options).map(|picked| picked.capabilities.index);
    for device in &mut found {
        // A device without this subgroup size keeps its own; opening it reports the error.
        let _ = device.choose_subgroup(options);
    }
    Ok((found, picked))
}
