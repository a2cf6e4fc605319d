//! Chooses and opens the physical device.

use super::GpuOptions;
use super::call::vk_call;
use super::capabilities::{Capabilities, MEMORY_REQUIREMENT};
use super::instance::Instance;
use super::lock::{self, DeviceLock};
use super::statistics;
use crate::error::{Error, Result, Setting};
use ash::vk;

/// A physical device with its capabilities.
#[derive(Clone)]
pub(super) struct Candidate {
    pub(super) physical: vk::PhysicalDevice,
    pub(super) capabilities: Capabilities,
}

/// Lists all devices, in the loader's order.
pub(super) fn candidates(instance: &Instance) -> Result<Vec<Candidate>> {
    // SAFETY: the instance is alive.
    let devices = vk_call("vkEnumeratePhysicalDevices", || unsafe { instance.raw().enumerate_physical_devices() })?;
    let probe = |(index, physical)| {
        let capabilities = Capabilities::probe(instance.raw(), index, physical)?;
        Ok(Candidate { physical, capabilities })
    };
    devices.into_iter().enumerate().map(probe).collect()
}

/// The selected device, and its lock if it came from a list.
pub(super) struct SelectedDevice {
    pub(super) physical: vk::PhysicalDevice,
    pub(super) capabilities: Capabilities,
    pub(super) lock: Option<DeviceLock>,
}

/// Selects a device by index, UUID or part of its name, or the first free device of a list; by default, the best that
/// meets the requirements.
pub(super) fn select_device(instance: &Instance, options: &GpuOptions) -> Result<SelectedDevice> {
    let devices = candidates(instance)?;
    if devices.is_empty() {
        return Err(Error::NoDevice("the Vulkan loader found no device; install a Vulkan driver".to_owned()));
    }
    let Some(wanted) = options.device.as_deref() else { return best(usable(&devices, None, options)?) };
    // A device name may contain a comma.
    if !wanted.contains(',') || devices.iter().any(|device| matches(&device.capabilities, wanted)) {
        return best(usable(&devices, Some(wanted), options)?);
    }
    let names = wanted.split(',').map(str::trim).filter(|name| !name.is_empty());
    let listed = names.map(|name| usable(&devices, Some(name), options)).collect::<Result<Vec<_>>>()?.concat();
    first_free(&listed, options)
}

/// Returns the devices that meet the requirements and match `wanted`, if given; the best first.
fn usable(devices: &[Candidate], wanted: Option<&str>, options: &GpuOptions) -> Result<Vec<Candidate>> {
    let listing = || devices.iter().map(|device| line(&device.capabilities)).collect::<Vec<_>>().join("; ");
    let mut found = devices.to_vec();
    if let Some(wanted) = wanted {
        found.retain(|device| matches(&device.capabilities, wanted));
        if found.is_empty() {
            return Err(Error::NoDevice(format!("no device matches {wanted}; found: {}", listing())));
        }
    }
    found.retain(|device| {
        device.capabilities.missing().iter().all(|need| options.statistics && need.what == MEMORY_REQUIREMENT)
    });
    if found.is_empty() {
        return Err(Error::NoDevice(format!("no device meets the requirements: {}", listing())));
    }
    found.sort_by_key(|device| (device.capabilities.kind, device.capabilities.index));
    Ok(found)
}

fn best(usable: Vec<Candidate>) -> Result<SelectedDevice> {
    let best = usable.into_iter().next().ok_or_else(|| Error::Bug("no device is left".to_owned()))?;
    Ok(SelectedDevice { physical: best.physical, capabilities: best.capabilities, lock: None })
}

/// Selects and locks the first device that no other process has locked.
fn first_free(listed: &[Candidate], options: &GpuOptions) -> Result<SelectedDevice> {
    let Some(folder) = &options.locks else {
        return Err(Error::usage(Setting("device"), "a list of devices needs a folder for locks; set `locks`"));
    };
    for Candidate { physical, capabilities } in listed {
        if let Some(lock) = lock::take(folder, capabilities)? {
            return Ok(SelectedDevice { physical: *physical, capabilities: capabilities.clone(), lock: Some(lock) });
        }
    }
    let names = listed
        .iter()
        .map(|Candidate { capabilities, .. }| format!("{}: {}", capabilities.index, capabilities.name))
        .collect::<Vec<_>>();
    Err(Error::NoDevice(match names.is_empty() {
        true => "the list of devices is empty; name at least one".to_owned(),
        false => format!(
            "all listed devices are in use by other labelgs processes ({}); wait for one of them, or list more devices",
            names.join("; ")
        ),
    }))
}

fn matches(device: &Capabilities, wanted: &str) -> bool {
    let lower = wanted.to_lowercase();
    // NVIDIA's tools write GPU-8f2ea41c-...
    let uuid = lower.strip_prefix("gpu-").unwrap_or(&lower).replace('-', "");
    match wanted.parse::<usize>() {
        Ok(index) if wanted.len() < 4 => device.index == index,
        _ => device.name.to_lowercase().contains(&lower) || device.uuid_text() == uuid,
    }
}

fn line(device: &Capabilities) -> String {
    let missing = device.missing();
    let lacks = missing.iter().map(|need| format!("{} (needed {}, found {})", need.what, need.needed, need.found));
    let lacks = lacks.collect::<Vec<_>>().join(", ");
    let lacks = if lacks.is_empty() { "usable".to_owned() } else { format!("lacks {lacks}") };
    format!("{}: {}, {lacks}", device.index, device.name)
}

/// Creates the logical device with a compute queue, a transfer queue if available, and all known features that the
/// device has.
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
        .timeline_semaphore(true)
        .vulkan_memory_model(features.memory_model)
        .vulkan_memory_model_device_scope(features.memory_model);
    let mut control = vk::PhysicalDeviceSubgroupSizeControlFeatures::default()
        .subgroup_size_control(features.size_control)
        .compute_full_subgroups(features.full_subgroups);
    let mut storage = vk::PhysicalDevice16BitStorageFeatures::default().storage_buffer16_bit_access(true);
    let priorities = [1.0];
    let families = [capabilities.queue_family].into_iter().chain(capabilities.transfer_family);
    let queue = |family| vk::DeviceQueueCreateInfo::default().queue_family_index(family).queue_priorities(&priorities);
    let queues: Vec<_> = families.map(queue).collect();
    let mut extensions = Vec::new();
    if capabilities.size_control_is_extension {
        extensions.push(ash::ext::subgroup_size_control::NAME.as_ptr());
    }
    let mut flow = vk::PhysicalDeviceShaderSubgroupUniformControlFlowFeaturesKHR::default()
        .shader_subgroup_uniform_control_flow(true);
    if features.uniform_flow {
        extensions.push(ash::khr::shader_subgroup_uniform_control_flow::NAME.as_ptr());
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
    if features.narrow_storage {
        info = info.push_next(&mut storage);
    }
    if features.uniform_flow {
        info = info.push_next(&mut flow);
    }
    if options.statistics {
        info = info.push_next(&mut executables);
    }
    // SAFETY: the device has every feature and extension in the list; all pointers live until the call returns.
    let created = vk_call("vkCreateDevice", || unsafe { instance.raw().create_device(physical, &info, None) });
    created.map_err(|error| Error::NoDevice(format!("{} cannot be opened: {error}", capabilities.name)))
}
