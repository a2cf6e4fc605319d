//! What the device tells of itself: a discrete GPU, or a CPU, with subgroups of one size.

use super::instance::VERSION;
use super::{chain, list, log};
use ash::vk;
use std::ffi::{CStr, c_char};

/// Memory that only the device sees, and memory that the host sees too.
pub(super) const DEVICE_MEMORY: u32 = 0;
const HEAP_BYTES: u64 = 8 << 30;

fn name(text: &CStr) -> [c_char; 256] {
    let mut name = [0; 256];
    name.iter_mut().zip(text.to_bytes()).for_each(|(to, from)| *to = from.cast_signed() as c_char);
    name
}

/// Workgroups at most along each axis.
pub(super) const MAX_GROUPS: [u32; 3] = [u32::MAX >> 1, 65535, 65535];
/// Descriptors at most, of each kind.
const MANY: u32 = 1 << 20;

fn limits() -> vk::PhysicalDeviceLimits {
    vk::PhysicalDeviceLimits {
        max_image_dimension1_d: 16384,
        max_image_dimension2_d: 16384,
        max_image_dimension3_d: 2048,
        max_image_dimension_cube: 16384,
        max_image_array_layers: 2048,
        max_texel_buffer_elements: 1 << 27,
        max_uniform_buffer_range: 1 << 16,
        max_storage_buffer_range: u32::MAX,
        max_push_constants_size: 256,
        max_memory_allocation_count: 4096,
        max_sampler_allocation_count: 4000,
        buffer_image_granularity: 1024,
        max_bound_descriptor_sets: 32,
        max_per_stage_descriptor_samplers: MANY,
        max_per_stage_descriptor_uniform_buffers: MANY,
        max_per_stage_descriptor_storage_buffers: MANY,
        max_per_stage_descriptor_sampled_images: MANY,
        max_per_stage_descriptor_storage_images: MANY,
        max_per_stage_resources: u32::MAX,
        max_descriptor_set_samplers: MANY,
        max_descriptor_set_uniform_buffers: MANY,
        max_descriptor_set_storage_buffers: MANY,
        max_descriptor_set_sampled_images: MANY,
        max_descriptor_set_storage_images: MANY,
        max_compute_shared_memory_size: 48 << 10,
        max_compute_work_group_count: MAX_GROUPS,
        max_compute_work_group_invocations: 1024,
        max_compute_work_group_size: [1024, 1024, 64],
        min_memory_map_alignment: 64,
        min_texel_buffer_offset_alignment: 16,
        min_uniform_buffer_offset_alignment: 64,
        min_storage_buffer_offset_alignment: 16,
        timestamp_compute_and_graphics: vk::TRUE,
        timestamp_period: 1.0,
        optimal_buffer_copy_offset_alignment: 1,
        optimal_buffer_copy_row_pitch_alignment: 1,
        non_coherent_atom_size: 64,
        ..vk::PhysicalDeviceLimits::default()
    }
}

fn core() -> vk::PhysicalDeviceProperties {
    vk::PhysicalDeviceProperties {
        api_version: VERSION,
        driver_version: 1,
        vendor_id: 0x10000,
        device_id: 1,
        device_type: log::options().kind,
        device_name: name(c"labelgs checker"),
        pipeline_cache_uuid: *b"labelgs checker\0",
        limits: limits(),
        ..vk::PhysicalDeviceProperties::default()
    }
}

pub(super) unsafe extern "system" fn properties(_: vk::PhysicalDevice, to: *mut vk::PhysicalDeviceProperties) {
    unsafe { *to = core() };
}

pub(super) unsafe extern "system" fn properties2(_: vk::PhysicalDevice, to: *mut vk::PhysicalDeviceProperties2<'_>) {
    let lanes = log::options().lanes;
    let (stages, operations) = (vk::ShaderStageFlags::COMPUTE, subgroup_operations());
    unsafe { (*to).properties = core() };
    for next in unsafe { chain((*to).p_next) } {
        match unsafe { (*next).s_type } {
            vk::StructureType::PHYSICAL_DEVICE_VULKAN_1_1_PROPERTIES => {
                let to = unsafe { &mut *next.cast::<vk::PhysicalDeviceVulkan11Properties<'_>>() };
                (to.device_uuid, to.driver_uuid) = (*b"labelgs checker\0", *b"labelgs checker\0");
                (to.subgroup_size, to.subgroup_supported_stages) = (lanes, stages);
                to.subgroup_supported_operations = operations;
                (to.max_per_set_descriptors, to.max_memory_allocation_size) = (MANY, HEAP_BYTES);
                (to.max_multiview_view_count, to.max_multiview_instance_index) = (6, 1 << 27);
            }
            vk::StructureType::PHYSICAL_DEVICE_SUBGROUP_PROPERTIES => {
                let to = unsafe { &mut *next.cast::<vk::PhysicalDeviceSubgroupProperties<'_>>() };
                (to.subgroup_size, to.supported_stages, to.supported_operations) = (lanes, stages, operations);
            }
            vk::StructureType::PHYSICAL_DEVICE_VULKAN_1_2_PROPERTIES => {
                let to = unsafe { &mut *next.cast::<vk::PhysicalDeviceVulkan12Properties<'_>>() };
                (to.driver_name, to.driver_info) = (name(c"labelgs checker"), name(c"runs every invocation alone"));
                to.max_timeline_semaphore_value_difference = u64::MAX >> 1;
                // The validation layer compares with these too.
                to.max_per_stage_descriptor_update_after_bind_uniform_buffers = MANY;
                to.max_per_stage_descriptor_update_after_bind_storage_buffers = MANY;
                to.max_per_stage_descriptor_update_after_bind_sampled_images = MANY;
                to.max_per_stage_update_after_bind_resources = u32::MAX;
                to.max_descriptor_set_update_after_bind_uniform_buffers = MANY;
                to.max_descriptor_set_update_after_bind_storage_buffers = MANY;
                to.max_descriptor_set_update_after_bind_sampled_images = MANY;
            }
            vk::StructureType::PHYSICAL_DEVICE_SUBGROUP_SIZE_CONTROL_PROPERTIES => {
                let to = unsafe { &mut *next.cast::<vk::PhysicalDeviceSubgroupSizeControlProperties<'_>>() };
                (to.min_subgroup_size, to.max_subgroup_size) = (lanes, lanes);
                (to.max_compute_workgroup_subgroups, to.required_subgroup_size_stages) = (1024 / lanes, stages);
            }
            vk::StructureType::PHYSICAL_DEVICE_MAINTENANCE_4_PROPERTIES => {
                let to = unsafe { &mut *next.cast::<vk::PhysicalDeviceMaintenance4Properties<'_>>() };
                to.max_buffer_size = HEAP_BYTES;
            }
            _ => {}
        }
    }
}

fn subgroup_operations() -> vk::SubgroupFeatureFlags {
    vk::SubgroupFeatureFlags::BASIC
        | vk::SubgroupFeatureFlags::VOTE
        | vk::SubgroupFeatureFlags::ARITHMETIC
        | vk::SubgroupFeatureFlags::BALLOT
        | vk::SubgroupFeatureFlags::SHUFFLE
}

fn core_features() -> vk::PhysicalDeviceFeatures {
    vk::PhysicalDeviceFeatures::default().robust_buffer_access(true)
}

pub(super) unsafe extern "system" fn features(_: vk::PhysicalDevice, to: *mut vk::PhysicalDeviceFeatures) {
    unsafe { *to = core_features() };
}

pub(super) unsafe extern "system" fn features2(_: vk::PhysicalDevice, to: *mut vk::PhysicalDeviceFeatures2<'_>) {
    unsafe { (*to).features = core_features() };
    for next in unsafe { chain((*to).p_next) } {
        match unsafe { (*next).s_type } {
            vk::StructureType::PHYSICAL_DEVICE_VULKAN_1_1_FEATURES => {
                let to = unsafe { &mut *next.cast::<vk::PhysicalDeviceVulkan11Features<'_>>() };
                to.storage_buffer16_bit_access = vk::TRUE;
            }
            vk::StructureType::PHYSICAL_DEVICE_VULKAN_1_2_FEATURES => {
                let to = unsafe { &mut *next.cast::<vk::PhysicalDeviceVulkan12Features<'_>>() };
                to.timeline_semaphore = vk::TRUE;
                (to.vulkan_memory_model, to.vulkan_memory_model_device_scope) = (vk::TRUE, vk::TRUE);
            }
            vk::StructureType::PHYSICAL_DEVICE_VULKAN_1_3_FEATURES => {
                let to = unsafe { &mut *next.cast::<vk::PhysicalDeviceVulkan13Features<'_>>() };
                (to.subgroup_size_control, to.compute_full_subgroups) = (vk::TRUE, vk::TRUE);
                to.maintenance4 = vk::TRUE;
            }
            vk::StructureType::PHYSICAL_DEVICE_16BIT_STORAGE_FEATURES => {
                let to = unsafe { &mut *next.cast::<vk::PhysicalDevice16BitStorageFeatures<'_>>() };
                to.storage_buffer16_bit_access = vk::TRUE;
            }
            vk::StructureType::PHYSICAL_DEVICE_TIMELINE_SEMAPHORE_FEATURES => {
                let to = unsafe { &mut *next.cast::<vk::PhysicalDeviceTimelineSemaphoreFeatures<'_>>() };
                to.timeline_semaphore = vk::TRUE;
            }
            vk::StructureType::PHYSICAL_DEVICE_SUBGROUP_SIZE_CONTROL_FEATURES => {
                let to = unsafe { &mut *next.cast::<vk::PhysicalDeviceSubgroupSizeControlFeatures<'_>>() };
                (to.subgroup_size_control, to.compute_full_subgroups) = (vk::TRUE, vk::TRUE);
            }
            _ => {}
        }
    }
}

fn memories() -> vk::PhysicalDeviceMemoryProperties {
    let mut all =
        vk::PhysicalDeviceMemoryProperties { memory_type_count: 2, memory_heap_count: 2, ..Default::default() };
    let host = vk::MemoryPropertyFlags::HOST_VISIBLE
        | vk::MemoryPropertyFlags::HOST_COHERENT
        | vk::MemoryPropertyFlags::HOST_CACHED;
    all.memory_types[0] = vk::MemoryType { property_flags: vk::MemoryPropertyFlags::DEVICE_LOCAL, heap_index: 0 };
    all.memory_types[1] = vk::MemoryType { property_flags: host, heap_index: 1 };
    all.memory_heaps[0] = vk::MemoryHeap { size: HEAP_BYTES, flags: vk::MemoryHeapFlags::DEVICE_LOCAL };
    all.memory_heaps[1] = vk::MemoryHeap { size: HEAP_BYTES, flags: vk::MemoryHeapFlags::empty() };
    all
}

pub(super) unsafe extern "system" fn memory(_: vk::PhysicalDevice, to: *mut vk::PhysicalDeviceMemoryProperties) {
    unsafe { *to = memories() };
}

pub(super) unsafe extern "system" fn memory2(_: vk::PhysicalDevice, to: *mut vk::PhysicalDeviceMemoryProperties2<'_>) {
    unsafe { (*to).memory_properties = memories() };
}

/// A family for all, and one for transfers, as GPUs have.
fn family(number: usize) -> vk::QueueFamilyProperties {
    let transfer = vk::QueueFlags::TRANSFER;
    vk::QueueFamilyProperties {
        queue_flags: if number == 0 { transfer | vk::QueueFlags::COMPUTE } else { transfer },
        queue_count: 1,
        timestamp_valid_bits: 64,
        min_image_transfer_granularity: vk::Extent3D { width: 1, height: 1, depth: 1 },
    }
}

fn family_count() -> usize {
    if log::options().kind == vk::PhysicalDeviceType::CPU { 1 } else { 2 }
}

pub(super) unsafe extern "system" fn families(
    _: vk::PhysicalDevice,
    count: *mut u32,
    to: *mut vk::QueueFamilyProperties,
) {
    let all = (0..family_count()).map(family).collect::<Vec<_>>();
    let _ = unsafe { list(&all, count, to) };
}

pub(super) unsafe extern "system" fn families2(
    _: vk::PhysicalDevice,
    count: *mut u32,
    to: *mut vk::QueueFamilyProperties2<'_>,
) {
    let number = family_count();
    unsafe {
        if !to.is_null() {
            (0..number.min(*count as usize)).for_each(|at| (*to.add(at)).queue_family_properties = family(at));
        }
        *count = number as u32;
    }
}

/// Words of an element of a texel buffer.
pub(super) fn texel_words(format: vk::Format) -> Option<u32> {
    match format {
        vk::Format::R32_UINT | vk::Format::R32_SFLOAT => Some(1),
        vk::Format::R32G32_SFLOAT => Some(2),
        vk::Format::R32G32B32A32_SFLOAT => Some(4),
        _ => None,
    }
}

fn format_features(format: vk::Format) -> vk::FormatProperties {
    let texels = texel_words(format).map(|_| vk::FormatFeatureFlags::UNIFORM_TEXEL_BUFFER);
    vk::FormatProperties { buffer_features: texels.unwrap_or_default(), ..vk::FormatProperties::default() }
}

pub(super) unsafe extern "system" fn format(_: vk::PhysicalDevice, format: vk::Format, to: *mut vk::FormatProperties) {
    unsafe { *to = format_features(format) };
}

pub(super) unsafe extern "system" fn format2(
    _: vk::PhysicalDevice,
    format: vk::Format,
    to: *mut vk::FormatProperties2<'_>,
) {
    let found = format_features(format);
    unsafe { (*to).format_properties = found };
    for next in unsafe { chain((*to).p_next) } {
        if unsafe { (*next).s_type } == vk::StructureType::FORMAT_PROPERTIES_3 {
            let to = unsafe { &mut *next.cast::<vk::FormatProperties3<'_>>() };
            to.buffer_features = vk::FormatFeatureFlags2::from_raw(u64::from(found.buffer_features.as_raw()));
        }
    }
}

/// There are no images.
pub(super) extern "system" fn image_format() -> vk::Result {
    vk::Result::ERROR_FORMAT_NOT_SUPPORTED
}

pub(super) extern "system" fn image_format2() -> vk::Result {
    vk::Result::ERROR_FORMAT_NOT_SUPPORTED
}

pub(super) unsafe extern "system" fn sparse_format(
    _: vk::PhysicalDevice,
    _: vk::Format,
    _: vk::ImageType,
    _: vk::SampleCountFlags,
    _: vk::ImageUsageFlags,
    _: vk::ImageTiling,
    count: *mut u32,
    to: *mut vk::SparseImageFormatProperties,
) {
    let _ = unsafe { list(&[], count, to) };
}

pub(super) unsafe extern "system" fn sparse_format2(
    _: vk::PhysicalDevice,
    _: *const vk::PhysicalDeviceSparseImageFormatInfo2<'_>,
    count: *mut u32,
    to: *mut vk::SparseImageFormatProperties2<'static>,
) {
    let _ = unsafe { list(&[], count, to) };
}

pub(super) unsafe extern "system" fn tools(
    _: vk::PhysicalDevice,
    count: *mut u32,
    to: *mut vk::PhysicalDeviceToolProperties<'static>,
) -> vk::Result {
    unsafe { list(&[], count, to) }
}

pub(super) unsafe extern "system" fn extensions(
    _: vk::PhysicalDevice,
    _: *const c_char,
    count: *mut u32,
    to: *mut vk::ExtensionProperties,
) -> vk::Result {
    unsafe { list(&[], count, to) }
}

pub(super) unsafe extern "system" fn layers(
    _: vk::PhysicalDevice,
    count: *mut u32,
    to: *mut vk::LayerProperties,
) -> vk::Result {
    unsafe { list(&[], count, to) }
}
