//! Queries that fill [`Capabilities`].

use super::call::vk_call;
use super::capabilities::{
    Capabilities, DeviceKind, Features, MEMORY_REQUIREMENT, Requirement, SUBGROUP_MAX, Subgroup,
};
use super::hidden::HiddenFeatures;
use super::limits::{Limits, PlanLimits};
use crate::error::Result;
use ash::vk;
use std::ffi::CStr;

/// Smallest device memory: one block of the allocator. A compile-only driver has none.
const MEMORY_MIN: u64 = 64 << 20;

/// Fewest storage buffers per shader (Vulkan's minimum): persistent buffers, scratch, reports, and one to spare.
const WINDOWS_MIN: u32 = 4;

impl Capabilities {
    /// Queries a device.
    pub(super) fn probe(instance: &ash::Instance, index: usize, physical: vk::PhysicalDevice) -> Result<Self> {
        // SAFETY: the handle belongs to this instance; here and below, the structs match the device's version.
        let mut core = unsafe { instance.get_physical_device_properties(physical) };
        let version = core.api_version;
        let extensions = vk_call("vkEnumerateDeviceExtensionProperties", || unsafe {
            instance.enumerate_device_extension_properties(physical)
        })?;
        let has = |name: &CStr| extensions.iter().any(|extension| extension.extension_name_as_c_str() == Ok(name));
        let is_1_3 = version >= vk::API_VERSION_1_3;
        let has_size_control = is_1_3 || has(ash::ext::subgroup_size_control::NAME);
        let hidden = HiddenFeatures::from_env()?;
        core.device_type = hidden.device_type(core.device_type);
        let mut features = features(instance, physical, has_size_control, has);
        hidden.features(&mut features);
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
        let family = compute_family(&families);
        let memory = memory(instance, physical, has(ash::ext::memory_budget::NAME));
        let timestamp_bits = family.map_or(0, |(_, properties)| properties.timestamp_valid_bits);
        let mut limits = limits(&core, &eleven, max_buffer, memory, timestamp_bits);
        limits.change_from_env()?;
        hidden.limits(&mut limits);
        let bindings = limits.plan.max_storage_buffers;
        limits.plan = limits.plan.packed();
        let mut subgroup = subgroup(&eleven, &control, &features);
        hidden.subgroup(&mut subgroup);
        let mut found = Self {
            index,
            name: text(core.device_name_as_c_str()),
            kind: kind(core.device_type),
            api_version: version_parts(version),
            driver_name: text(twelve.driver_name_as_c_str()),
            driver_info: text(twelve.driver_info_as_c_str()),
            uuid: eleven.device_uuid,
            limits,
            subgroup,
            needs: Vec::new(),
            features,
            queue_family: family.map_or(0, |(index, _)| index),
            transfer_family: hidden.transfer(transfer_family(&families)),
            size_control_is_extension: has_size_control && !is_1_3,
        };
        found.needs = needs(&found, family.is_some(), bindings);
        if !found.subgroup.serves() {
            found.subgroup.emulate(found.is_cpu());
        }
        Ok(found)
    }
}

/// Returns major, minor and patch number of a version.
fn version_parts(version: u32) -> (u32, u32, u32) {
    (vk::api_version_major(version), vk::api_version_minor(version), vk::api_version_patch(version))
}

/// Queries the known features of the device.
fn features(
    instance: &ash::Instance,
    physical: vk::PhysicalDevice,
    size_control: bool,
    has: impl Fn(&CStr) -> bool,
) -> Features {
    let mut twelve = vk::PhysicalDeviceVulkan12Features::default();
    let mut control = vk::PhysicalDeviceSubgroupSizeControlFeatures::default();
    let mut storage = vk::PhysicalDevice16BitStorageFeatures::default();
    let mut flow = vk::PhysicalDeviceShaderSubgroupUniformControlFlowFeaturesKHR::default();
    // SAFETY: the handle belongs to this instance.
    let version = unsafe { instance.get_physical_device_properties(physical) }.api_version;
    let mut all = vk::PhysicalDeviceFeatures2::default();
    if version >= vk::API_VERSION_1_2 {
        all = all.push_next(&mut twelve).push_next(&mut storage);
    }
    if size_control {
        all = all.push_next(&mut control);
    }
    if has(ash::khr::shader_subgroup_uniform_control_flow::NAME) {
        all = all.push_next(&mut flow);
    }
    // SAFETY: the device's version and extensions support the chained structs.
    unsafe { instance.get_physical_device_features2(physical, &mut all) };
    let core = all.features;
    let on = |flag: vk::Bool32| flag == vk::TRUE;
    Features {
        memory_model: on(twelve.vulkan_memory_model) && on(twelve.vulkan_memory_model_device_scope),
        timeline: on(twelve.timeline_semaphore),
        robust: on(core.robust_buffer_access),
        size_control: on(control.subgroup_size_control),
        full_subgroups: on(control.compute_full_subgroups),
        statistics: has(ash::khr::pipeline_executable_properties::NAME),
        narrow_storage: on(storage.storage_buffer16_bit_access),
        uniform_flow: on(flow.shader_subgroup_uniform_control_flow),
    }
}

/// Selects a queue family: compute without graphics, because it is least busy, else any with compute.
fn compute_family(families: &[vk::QueueFamilyProperties]) -> Option<(u32, vk::QueueFamilyProperties)> {
    let computes = |family: &&(u32, vk::QueueFamilyProperties)| family.1.queue_flags.contains(vk::QueueFlags::COMPUTE);
    let numbered = families.iter().enumerate().map(|(index, family)| (index as u32, *family)).collect::<Vec<_>>();
    let draws = |family: &&(u32, vk::QueueFamilyProperties)| family.1.queue_flags.contains(vk::QueueFlags::GRAPHICS);
    // A family without timestamps is the last choice.
    let rank =
        |family: &&(u32, vk::QueueFamilyProperties)| (family.1.timestamp_valid_bits == 0, draws(family), family.0);
    numbered.iter().filter(computes).min_by_key(rank).copied()
}

/// Selects a transfer-only queue family, if there is one.
fn transfer_family(families: &[vk::QueueFamilyProperties]) -> Option<u32> {
    let only = vk::QueueFlags::TRANSFER | vk::QueueFlags::SPARSE_BINDING | vk::QueueFlags::PROTECTED;
    let copies = |flags: vk::QueueFlags| flags.contains(vk::QueueFlags::TRANSFER) && only.contains(flags);
    families.iter().position(|family| copies(family.queue_flags)).map(|index| index as u32)
}

/// Returns the size of the device's largest heap, and how much of it the engine may use.
fn memory(instance: &ash::Instance, physical: vk::PhysicalDevice, has_budget: bool) -> (u64, u64) {
    let mut budget = vk::PhysicalDeviceMemoryBudgetPropertiesEXT::default();
    let mut all = vk::PhysicalDeviceMemoryProperties2::default();
    if has_budget {
        all = all.push_next(&mut budget);
    }
    // SAFETY: the handle belongs to this instance, and the device supports the chained struct.
    unsafe { instance.get_physical_device_memory_properties2(physical, &mut all) };
    let heaps = all.memory_properties;
    let local = |heap: &vk::MemoryHeap| heap.flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL);
    let heaps = heaps.memory_heaps.iter().take(heaps.memory_heap_count as usize).enumerate();
    let Some((index, heap)) = heaps.filter(|(_, heap)| local(heap)).max_by_key(|(_, heap)| heap.size) else {
        return (0, 0);
    };
    // Keep part of the budget free: beyond it, drivers may swap, slow down or lose the device.
    let free = if has_budget { budget.heap_budget[index].min(heap.size) } else { heap.size };
    (heap.size, free / 100 * 90)
}

/// Converts the limits.
fn limits(
    properties: &vk::PhysicalDeviceProperties,
    eleven: &vk::PhysicalDeviceVulkan11Properties<'_>,
    max_buffer: u64,
    (heap, max_memory): (u64, u64),
    timestamp_bits: u32,
) -> Limits {
    let core = &properties.limits;
    let plan = PlanLimits {
        max_storage_range: u64::from(core.max_storage_buffer_range),
        max_texel_elements: u64::from(core.max_texel_buffer_elements),
        storage_alignment: core.min_storage_buffer_offset_alignment,
        texel_alignment: core.min_texel_buffer_offset_alignment,
        max_groups: core.max_compute_work_group_count,
        max_allocation: eleven.max_memory_allocation_size.min(max_buffer),
        max_storage_buffers: core
            .max_per_stage_descriptor_storage_buffers
            .min(core.max_descriptor_set_storage_buffers)
            .min(core.max_per_stage_resources),
        max_texel_buffers: core
            .max_per_stage_descriptor_sampled_images
            .min(core.max_descriptor_set_sampled_images)
            .min(core.max_per_stage_resources),
        max_memory,
        ..PlanLimits::default()
    };
    let plan = if kind(properties.device_type) == DeviceKind::Cpu { plan } else { plan.for_gpu() };
    Limits {
        plan,
        max_group_size: core.max_compute_work_group_size,
        max_invocations: core.max_compute_work_group_invocations,
        max_shared: core.max_compute_shared_memory_size,
        heap,
        timestamp_period: if timestamp_bits == 0 { 0.0 } else { core.timestamp_period },
        timestamp_bits,
    }
}

/// Converts the subgroup properties.
fn subgroup(
    eleven: &vk::PhysicalDeviceVulkan11Properties<'_>,
    control: &vk::PhysicalDeviceSubgroupSizeControlProperties<'_>,
    features: &Features,
) -> Subgroup {
    let compute = vk::ShaderStageFlags::COMPUTE;
    let is_pinned = features.size_control && control.required_subgroup_size_stages.contains(compute);
    let is_certain = is_pinned || (features.size_control && control.min_subgroup_size == control.max_subgroup_size);
    let in_compute = eleven.subgroup_supported_stages.contains(compute);
    let none = vk::SubgroupFeatureFlags::empty();
    let size = eleven.subgroup_size;
    let (min, max) = match is_pinned {
        true => (control.min_subgroup_size, control.max_subgroup_size.min(SUBGROUP_MAX).max(control.min_subgroup_size)),
        false => (size, size),
    };
    Subgroup {
        size: Subgroup::preferred_size(size, min, max),
        min,
        max,
        max_per_group: if is_pinned { control.max_compute_workgroup_subgroups } else { u32::MAX },
        is_pinned,
        is_certain,
        is_emulated: false,
        operations: if in_compute { eleven.subgroup_supported_operations } else { none },
    }
}

/// Checks the device against requirements and optional features.
fn needs(found: &Capabilities, has_queue: bool, bindings: u32) -> Vec<Requirement> {
    let (limits, features) = (&found.limits, &found.features);
    let (major, minor, patch) = found.api_version;
    let flag = |what, is_met, reason| need(what, is_met, "yes", if is_met { "yes" } else { "no" }.to_owned(), reason);
    let least = |what, needed: u32, found: u32, reason| {
        need(what, found >= needed, &needed.to_string(), found.to_string(), reason)
    };
    let mut needs = vec![
        need("Vulkan", (major, minor) >= (1, 2), "1.2", format!("{major}.{minor}.{patch}"), "everything"),
        flag("compute queue", has_queue, "everything"),
        need(
            MEMORY_REQUIREMENT,
            limits.heap >= MEMORY_MIN,
            "64 MiB",
            format!("{} MiB", limits.heap >> 20),
            "everything",
        ),
        flag("timelineSemaphore", features.timeline, "two steps in flight"),
        least("workgroup size", 128, limits.max_invocations, "projection"),
        least("storage buffers per shader", WINDOWS_MIN, bindings, "all buffers share these bindings if there are few"),
    ];
    needs.extend(wishes(limits, &found.subgroup));
    needs
}

/// Optional features; `reason` says what the engine loses without them.
fn wishes(limits: &Limits, subgroup: &Subgroup) -> [Requirement; 5] {
    let wish = |what, is_met, found: String, reason| Requirement {
        is_required: false,
        ..need(what, is_met, "optional", found, reason)
    };
    let operations = if subgroup.has_operations() { "yes" } else { "no" }.to_owned();
    let pins = format!("{} of {}..{}", subgroup.size, subgroup.min, subgroup.max);
    let (range, bits, period) = (limits.plan.max_storage_range, limits.timestamp_bits, limits.timestamp_period);
    [
        wish("subgroup shuffle, arithmetic", subgroup.has_operations(), operations, "slower, through shared memory"),
        wish("subgroups of 8 to 64", subgroup.has_size(), subgroup.size.to_string(), "slower, through shared memory"),
        wish("one subgroup size, or pinned", subgroup.is_certain, pins, "slower, through shared memory"),
        wish("storage binding of 1 GiB", range >= 1 << 30, format!("{range} B"), "fewer Gaussians at most"),
        wish("timestamps", bits > 0, format!("{bits} bits, {period} ns"), "no time by pass"),
    ]
}

fn need(what: &'static str, is_met: bool, needed: &str, found: String, reason: &'static str) -> Requirement {
    Requirement { what, is_required: true, needed: needed.to_owned(), found, is_met, reason }
}

fn text<E>(name: std::result::Result<&CStr, E>) -> String {
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
