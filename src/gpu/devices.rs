//! The list of devices.

use super::GpuOptions;
use super::capabilities::Capabilities;
use super::instance::{Instance, Validation};
use super::select;
use crate::error::Result;

/// Lists all devices. Also returns the index of the device that [`Gpu::new`](super::Gpu::new) selects with these
/// options, or its error.
pub fn devices(options: &GpuOptions) -> Result<(Vec<Capabilities>, Result<usize>)> {
    let instance = Instance::new(Validation::Off)?;
    let mut found: Vec<Capabilities> =
        select::candidates(&instance)?.into_iter().map(|device| device.capabilities).collect();
    let selected = select::select_device(&instance, options).map(|device| device.capabilities.index);
    for device in &mut found {
        // A device without this subgroup size keeps its own; opening it reports the error.
        let _ = device.choose_subgroup(options);
    }
    Ok((found, selected))
}
