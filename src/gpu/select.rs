//! Chooses and opens the physical device.

use super::GpuOptions;
use super::call::vk_call;
use super::capabilities::{Capabilities, MEMORY};
use super::instance::Instance;
use super::statistics;
use crate::error::{Error, Result};
use ash::vk;

/// All devices, in the loader's order.
pub(super) fn all(instance: &Instance) -> Result<Vec<(vk::PhysicalDevice, Capabilities)>> {
    // SAFETY: the instance is alive.
    let devices = vk_call("vkEnumeratePhysicalDevices", || unsafe { instance.raw().enumerate_physical_devices() })?;
    let probe = |(index, device)| Ok((device, Capabilities::probe(instance.raw(), index, device)?));
    devices.into_iter().enumerate().map(probe).collect()
}

/// Picks a device by index, UUID or part of its name; by default the best that meets the requirements.
pub(super) fn pick(instance: &Instance, options: &GpuOptions) -> Result<(vk::PhysicalDevice, Capabilities)> {
    let wanted = options.device.as_deref();
    let mut devices = all(instance)?;
    let listing = devices.iter().map(|(_, device)| line(device)).collect::<Vec<_>>().join("; ");
    if devices.is_empty() {
        return Err(Error::NoDevice("the Vulkan loader found no device; install a Vulkan driver".to_owned()));
    }
    if let Some(wanted) = wanted {
        devices.retain(|(_, device)| matches(device, wanted));
        if devices.is_empty() {
            return Err(Error::NoDevice(format!("none matches {wanted}; found: {listing}")));
        }
    }
    devices.retain(|(_, device)| device.missing().iter().all(|need| options.statistics && need.what == MEMORY));
    let best = devices.into_iter().min_by_key(|(_, device)| (device.kind, device.index));
    best.ok_or_else(|| Error::NoDevice(format!("none meets the requirements: {listing}")))
}

fn matches(device: &Capabilities, wanted: &str) -> bool {
    let uuid = wanted.replace('-', "").to_lowercase();
    match wanted.parse::<usize>() {
        Ok(index) if wanted.len() < 4 => device.index == index,
        _ => device.name.to_lowercase().contains(&wanted.to_lowercase()) || device.uuid_text() == uuid,
    }
}

fn line(device: &Capabilities) -> String {
    let missing = device.missing();
    let lacks = missing.iter().map(|need| format!("{} (needed {}, found {})", need.what, need.needed, need.found));
    let lacks = lacks.collect::<Vec<_>>().join(", ");
    let lacks = if lacks.is_empty() { "usable".to_owned() } else { format!("lacks {lacks}") };
    format!("{}: {}, {lacks}", device.index, device.name)
}

/// Creates the logical device with one compute queue and the known features that the device has.
pub(super) fn open(
    instance: &Instance,
    physical: vk::PhysicalDevice,
    capabilities: &Capabilities,
    options: &GpuOptions,
) -> Result<ash::Device> {
    let features = &capabilities.features;
    let core =
        vk::PhysicalDeviceFeatures::default().robust_buffer_access(options.robust_buffer_access && features.robust);
    let mut twelve = vk::PhysicalDeviceVulkan12Features::default()
        .scalar_block_layout(true)
        .timeline_semaphore(true)
        .vulkan_memory_model(features.memory_model)
        .vulkan_memory_model_device_scope(features.memory_model);
    let mut control = vk::PhysicalDeviceSubgroupSizeControlFeatures::default()
        .subgroup_size_control(features.size_control)
        .compute_full_subgroups(features.full_subgroups);
    let priorities = [1.0];
    let queues = [vk::DeviceQueueCreateInfo::default()
        .queue_family_index(capabilities.queue_family)
        .queue_priorities(&priorities)];
    let mut extensions = Vec::new();
    if capabilities.size_control_is_extension {
        extensions.push(ash::ext::subgroup_size_control::NAME.as_ptr());
    }
    let mut executables =
        vk::PhysicalDevicePipelineExecutablePropertiesFeaturesKHR::default().pipeline_executable_info(true);
    if options.statistics {
        if !features.statistics {
            return Err(statistics::unknown(capabilities));
        }
        extensions.push(ash::khr::pipeline_executable_properties::NAME.as_ptr());
    }
    let mut info = vk::DeviceCreateInfo::default()
        .queue_create_infos(&queues)
        .enabled_features(&core)
        .enabled_extension_names(&extensions)
        .push_next(&mut twelve);
    if features.size_control {
        info = info.push_next(&mut control);
    }
    if options.statistics {
        info = info.push_next(&mut executables);
    }
    // SAFETY: the device has every feature and extension in the list; all pointers live until the call returns.
    let created = vk_call("vkCreateDevice", || unsafe { instance.raw().create_device(physical, &info, None) });
    created.map_err(|error| Error::NoDevice(format!("{} cannot be opened: {error}", capabilities.name)))
}
