//! Properties and features of a device, and the engine's requirements.

use super::GpuOptions;
use super::limits::Limits;
use crate::error::{Error, Result};
use ash::vk;
use std::fmt;

/// Kind of a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum DeviceKind {
    /// A discrete GPU; preferred.
    Discrete,
    /// An integrated GPU.
    Integrated,
    /// A GPU of a virtual machine.
    Virtual,
    /// Unknown.
    Other,
    /// The CPU, as with lavapipe.
    Cpu,
}

/// A required or optional feature or limit; one line of `labelgs devices`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Requirement {
    /// The feature or limit.
    pub what: &'static str,
    /// True if the engine does not run without it.
    pub is_required: bool,
    /// Needed value.
    pub needed: String,
    /// The device's value.
    pub found: String,
    /// True if the value suffices.
    pub is_met: bool,
    /// What the feature or limit is used for.
    pub reason: &'static str,
}

/// Name of the memory requirement, which does not apply to compile-only use.
pub(super) const MEMORY_REQUIREMENT: &str = "memory";
/// Smallest subgroup size that kernels support.
pub(crate) const SUBGROUP_MIN: u32 = 4;
/// Smallest native subgroup size that kernels use; smaller ones are emulated.
const OWN_SUBGROUP_MIN: u32 = 8;
/// Size of emulated subgroups on GPUs.
const EMULATED_SUBGROUP: u32 = 32;
/// Subgroup operations that the kernels use.
const SUBGROUP_OPERATIONS: vk::SubgroupFeatureFlags = vk::SubgroupFeatureFlags::from_raw(
    vk::SubgroupFeatureFlags::BASIC.as_raw()
        | vk::SubgroupFeatureFlags::ARITHMETIC.as_raw()
        | vk::SubgroupFeatureFlags::SHUFFLE.as_raw(),
);
/// Largest subgroup size that kernels support: a strip of the loss and the longest butterfly have 64 lanes.
pub(crate) const SUBGROUP_MAX: u32 = 64;

/// Subgroup properties of a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Subgroup {
    /// Subgroup size of the engine's pipelines.
    pub size: u32,
    /// Smallest size to choose from.
    pub min: u32,
    /// Largest size to choose from.
    pub max: u32,
    /// Maximum number of subgroups per workgroup with a pinned size.
    pub max_per_group: u32,
    /// True if pipelines pin the size.
    pub is_pinned: bool,
    /// True if the size is certain: it is pinned, or the device has only one. Otherwise the driver may choose a size
    /// other than its reported default.
    pub is_certain: bool,
    /// True if subgroups are emulated: neighbouring invocations exchange values through shared memory.
    pub is_emulated: bool,
    /// Subgroup operations available in compute shaders.
    pub operations: vk::SubgroupFeatureFlags,
}

impl Subgroup {
    /// True if the device has the operations that the kernels use.
    pub(super) fn has_operations(&self) -> bool {
        self.operations.contains(SUBGROUP_OPERATIONS)
    }

    /// True if the device has ballots, which some kernels use.
    pub fn has_ballots(&self) -> bool {
        self.operations.contains(vk::SubgroupFeatureFlags::BALLOT)
    }

    /// True if the kernels can use subgroups of the device's default size.
    pub(super) fn has_size(&self) -> bool {
        (OWN_SUBGROUP_MIN..=SUBGROUP_MAX).contains(&self.size)
    }

    /// True if the kernels can use native subgroups.
    pub(super) fn serves(&self) -> bool {
        self.is_certain && self.has_size() && self.has_operations()
    }

    /// Returns the size to use where a driver offers `min` to `max` and reports `default`. A device that compiles a
    /// kernel for 8 lanes or for 32 has fewer registers per lane in the wider form: 32 spill, 16 fit.
    pub fn preferred_size(default: u32, min: u32, max: u32) -> u32 {
        let is_flexible = min <= OWN_SUBGROUP_MIN && max >= 32;
        if is_flexible { 16 } else { default.clamp(min, max) }
    }

    /// Emulates subgroups. A CPU keeps its vector width.
    pub(super) fn emulate(&mut self, is_cpu: bool) {
        (self.is_emulated, self.min, self.max) = (true, SUBGROUP_MIN, SUBGROUP_MAX);
        self.size = if is_cpu && self.size.is_power_of_two() { self.size } else { EMULATED_SUBGROUP };
        self.size = self.size.clamp(self.min, self.max);
    }

    /// Sets the subgroup size.
    pub(super) fn pin(&mut self, size: Option<u32>) -> Result<()> {
        let Some(size) = size.filter(|&size| size != self.size) else { return Ok(()) };
        let (min, max) = (self.min, self.max);
        if !size.is_power_of_two() || !(min..=max).contains(&size) {
            return Err(Error::usage(
                "subgroup size",
                format!("this device has no subgroups of {size}; it offers powers of two from {min} to {max}"),
            ));
        }
        self.size = size;
        Ok(())
    }
}

impl fmt::Display for Subgroup {
    /// `subgroups of 32`, or `emulated subgroups of 32`.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}subgroups of {}", if self.is_emulated { "emulated " } else { "" }, self.size)
    }
}

/// Features to enable if the device has them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Features {
    pub(super) memory_model: bool,
    pub(super) timeline: bool,
    pub(super) robust: bool,
    pub(super) size_control: bool,
    pub(super) full_subgroups: bool,
    pub(super) statistics: bool,
    pub(super) narrow_storage: bool,
    /// Subgroups reconverge in flow that is uniform for them (`uniform_flow`).
    pub(super) uniform_flow: bool,
}

/// Properties and features of a device.
#[derive(Clone, Debug)]
pub struct Capabilities {
    /// Position in the loader's list.
    pub index: usize,
    /// Name of the device.
    pub name: String,
    /// Kind of the device.
    pub kind: DeviceKind,
    /// Vulkan version of the device.
    pub api_version: (u32, u32, u32),
    /// Name of the driver.
    pub driver_name: String,
    /// Version of the driver, in the driver's own format.
    pub driver_info: String,
    /// Identifier of the device across processes.
    pub uuid: [u8; 16],
    /// Limits.
    pub limits: Limits,
    /// Subgroups.
    pub subgroup: Subgroup,
    /// Requirements and optional features, met or not.
    pub needs: Vec<Requirement>,
    pub(super) features: Features,
    pub(super) queue_family: u32,
    /// Family of a separate transfer queue.
    pub(super) transfer_family: Option<u32>,
    /// True if subgroup size control is an extension, not part of Vulkan 1.3.
    pub(super) size_control_is_extension: bool,
}

impl Capabilities {
    /// True if the device is the CPU.
    pub fn is_cpu(&self) -> bool {
        self.kind == DeviceKind::Cpu
    }

    /// True if shaders can load and store 16-bit values.
    pub fn has_narrow_storage(&self) -> bool {
        self.features.narrow_storage
    }

    /// True if workgroups can hand plain data to others of their dispatch.
    pub fn has_memory_model(&self) -> bool {
        self.features.memory_model
    }

    /// Sets the subgroup size from the options.
    pub(super) fn choose_subgroup(&mut self, options: &GpuOptions) -> Result<()> {
        if options.emulate_subgroups {
            self.subgroup.emulate(self.is_cpu());
        }
        self.subgroup.pin(options.subgroup_size)
    }

    /// Requirements that the device does not meet.
    pub fn missing(&self) -> Vec<&Requirement> {
        self.needs.iter().filter(|need| need.is_required && !need.is_met).collect()
    }

    /// The UUID as text.
    pub fn uuid_text(&self) -> String {
        self.uuid.iter().map(|byte| format!("{byte:02x}")).collect()
    }
}
