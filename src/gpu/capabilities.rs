//! What a device is and can do, against what the engine needs.

use super::call::vk_call;
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
    /// True if the size is pinned; else the driver's default is hoped for.
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
    /// Asks a device.
    pub(super) fn probe(instance: &ash::Instance, index: usize, physical: vk::PhysicalDevice) -> Result<Self> {
        // SAFETY: the handle comes from this instance; here and below the structs match the device's version.
        let core = unsafe { instance.get_physical_device_properties(physical) };
        let version = core.api_version;
        let api_version =
            (vk::api_version_major(version), vk::api_version_minor(version), vk::api_version_patch(version));
        let extensions = vk_call("vkEnumerateDeviceExtensionProperties", || unsafe {
            instance.enumerate_device_extension_properties(physical)
        })?;
        let has = |name| extensions.iter().any(|extension| extension.extension_name_as_c_str() == Ok(name));
        let is_1_3 = version >= vk::API_VERSION_1_3;
        let has_size_control = is_1_3 || has(ash::ext::subgroup_size_control::NAME);
        let features = super::devices::features(instance, physical, has_size_control);
        let mut eleven = vk::PhysicalDeviceVulkan11Properties::default();
        let mut twelve = vk::PhysicalDeviceVulkan12Properties::default();
        let mut control = vk::PhysicalDeviceSubgroupSizeControlProperties::default();
        let mut buffers = vk::PhysicalDeviceMaintenance4Properties::default();
        let mut all = vk::PhysicalDeviceProperties2::default();
        if version >= vk::API_VERSION_1_2 {
            all = all.push_next(&mut eleven).push_next(&mut twelve);
        }
        if has_size_control {
            all = all.push_next(&mut control);
        }
        if is_1_3 {
            all = all.push_next(&mut buffers);
        }
        unsafe { instance.get_physical_device_properties2(physical, &mut all) };
        let max_buffer = if is_1_3 { buffers.max_buffer_size } else { u64::MAX };
        let families = unsafe { instance.get_physical_device_queue_family_properties(physical) };
        let family = super::devices::compute_family(&families);
        let memory = super::devices::memory(instance, physical, has(ash::ext::memory_budget::NAME));
        let timestamp_bits = family.map_or(0, |(_, properties)| properties.timestamp_valid_bits);
        let mut limits = super::devices::limits(&core.limits, &eleven, max_buffer, memory, timestamp_bits);
        limits.lower_by_env()?;
        let subgroup = super::devices::subgroup(&eleven, &control, &features);
        let mut found = Self {
            index,
            name: text(core.device_name_as_c_str()),
            kind: kind(core.device_type),
            api_version,
            driver_name: text(twelve.driver_name_as_c_str()),
            driver_info: text(twelve.driver_info_as_c_str()),
            uuid: eleven.device_uuid,
            limits,
            subgroup,
            needs: Vec::new(),
            features,
            queue_family: family.map_or(0, |(index, _)| index),
            size_control_is_extension: has_size_control && !is_1_3,
        };
        found.needs = super::devices::needs(&found, family.is_some());
        Ok(found)
    }

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

fn text<E>(name: std::result::Result<&std::ffi::CStr, E>) -> String {
    name.map_or_else(|_| String::new(), |name| name.to_string_lossy().into_owned())
}

fn kind(kind: vk::PhysicalDeviceType) -> DeviceKind {
    match kind {
        vk::PhysicalDeviceType::DISCRETE_GPU => DeviceKind::Discrete,
        vk::PhysicalDeviceType::INTEGRATED_GPU => DeviceKind::Integrated,
        vk::PhysicalDeviceType::VIRTUAL_GPU => DeviceKind::Virtual,
        vk::PhysicalDeviceType::CPU => DeviceKind::Cpu,
        _ => DeviceKind::Other,
    }
}
