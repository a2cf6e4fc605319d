//! What a device is and can do, against what the engine needs.

use super::limits::Limits;
use crate::error::{Error, Result};
use ash::vk;

/// What kind of device it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum DeviceKind {
    /// A graphics card; preferred.
    Discrete,
    /// Graphics in the processor.
    Integrated,
    /// A device of a virtual machine.
    Virtual,
    /// Unknown.
    Other,
    /// The host's processor, as with lavapipe.
    Cpu,
}

/// One line of the table of `labelgs devices`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Need {
    /// The feature or limit.
    pub what: &'static str,
    /// Without it the engine does not run.
    pub is_required: bool,
    /// What is needed.
    pub needed: String,
    /// What the device has.
    pub found: String,
    /// True if that is enough.
    pub is_met: bool,
    /// What it is for.
    pub reason: &'static str,
}

/// The smallest subgroups that there are kernels for.
pub(crate) const SUBGROUP_MIN: u32 = 8;
/// The largest ones: a strip of the loss and the longest butterfly have 64 lanes.
pub(crate) const SUBGROUP_MAX: u32 = 64;

/// Subgroups of a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Subgroup {
    /// Size of the subgroups of our pipelines.
    pub size: u32,
    /// Smallest size that can be pinned.
    pub min: u32,
    /// Largest size that can be pinned.
    pub max: u32,
    /// Most subgroups of a workgroup whose size is pinned.
    pub max_per_group: u32,
    /// True if the size is pinned; else it is the driver's default, which may be another than it tells.
    pub is_pinned: bool,
    /// Operations in compute shaders.
    pub operations: vk::SubgroupFeatureFlags,
}

impl Subgroup {
    /// Chooses the size.
    pub(super) fn pin(&mut self, size: Option<u32>) -> Result<()> {
        let Some(size) = size.filter(|&size| size != self.size) else { return Ok(()) };
        let (min, max) = (self.min, self.max);
        if !self.is_pinned || !size.is_power_of_two() || !(min..=max).contains(&size) {
            let offered =
                if self.is_pinned { format!("powers of two from {min} to {max}") } else { self.size.to_string() };
            return Err(Error::usage(
                "subgroup size",
                format!("this device has no subgroups of {size}; it offers {offered}"),
            ));
        }
        self.size = size;
        Ok(())
    }
}

/// Features that are switched on where the device has them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Features {
    pub(super) memory_model: bool,
    pub(super) scalar: bool,
    pub(super) timeline: bool,
    pub(super) robust: bool,
    pub(super) size_control: bool,
    pub(super) full_subgroups: bool,
}

/// What a device is and can do.
#[derive(Clone, Debug)]
pub struct Capabilities {
    /// Position in the loader's list.
    pub index: usize,
    /// Name of the device.
    pub name: String,
    /// What kind it is.
    pub kind: DeviceKind,
    /// Vulkan version of the device.
    pub api_version: (u32, u32, u32),
    /// Name of the driver.
    pub driver_name: String,
    /// Version of the driver, as the driver writes it.
    pub driver_info: String,
    /// Identifies the device across processes.
    pub uuid: [u8; 16],
    /// Limits.
    pub limits: Limits,
    /// Subgroups.
    pub subgroup: Subgroup,
    /// Requirements and options, met or not.
    pub needs: Vec<Need>,
    pub(super) features: Features,
    pub(super) queue_family: u32,
    /// Subgroup size control comes from the extension, not from Vulkan 1.3.
    pub(super) size_control_is_extension: bool,
}

impl Capabilities {
    /// True if the "device" is the host's processor.
    pub fn is_cpu(&self) -> bool {
        self.kind == DeviceKind::Cpu
    }

    /// The requirements that the device does not meet.
    pub fn missing(&self) -> Vec<&Need> {
        self.needs.iter().filter(|need| need.is_required && !need.is_met).collect()
    }

    /// The UUID as text.
    pub fn uuid_text(&self) -> String {
        self.uuid.iter().map(|byte| format!("{byte:02x}")).collect()
    }
}
