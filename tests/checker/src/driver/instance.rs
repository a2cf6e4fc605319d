//! The instance, with its one device.

use super::{LOADER_MAGIC, destroy as drop_object, handle, list};
use ash::vk;
use std::ffi::{c_char, c_void};

/// The version that is reported.
pub(super) const VERSION: u32 = vk::API_VERSION_1_3;

#[repr(C)]
struct Instance {
    loader: usize,
    device: vk::PhysicalDevice,
}

#[repr(C)]
struct PhysicalDevice {
    loader: usize,
}

pub(super) unsafe extern "system" fn create(
    _: *const vk::InstanceCreateInfo<'_>,
    _: *const c_void,
    instance: *mut vk::Instance,
) -> vk::Result {
    let device = handle(PhysicalDevice { loader: LOADER_MAGIC });
    unsafe { *instance = handle(Instance { loader: LOADER_MAGIC, device }) };
    vk::Result::SUCCESS
}

pub(super) unsafe extern "system" fn destroy(instance: vk::Instance, _: *const c_void) {
    if instance != vk::Instance::null() {
        unsafe {
            drop_object::<PhysicalDevice>(super::object::<Instance>(instance).device);
            drop_object::<Instance>(instance);
        }
    }
}

pub(super) unsafe extern "system" fn version(version: *mut u32) -> vk::Result {
    unsafe { *version = VERSION };
    vk::Result::SUCCESS
}

pub(super) unsafe extern "system" fn extensions(
    _: *const c_char,
    count: *mut u32,
    to: *mut vk::ExtensionProperties,
) -> vk::Result {
    unsafe { list(&[], count, to) }
}

pub(super) unsafe extern "system" fn layers(count: *mut u32, to: *mut vk::LayerProperties) -> vk::Result {
    unsafe { list(&[], count, to) }
}

pub(super) unsafe extern "system" fn devices(
    instance: vk::Instance,
    count: *mut u32,
    to: *mut vk::PhysicalDevice,
) -> vk::Result {
    unsafe { list(&[super::object::<Instance>(instance).device], count, to) }
}

pub(super) unsafe extern "system" fn groups(
    instance: vk::Instance,
    count: *mut u32,
    to: *mut vk::PhysicalDeviceGroupProperties<'_>,
) -> vk::Result {
    if to.is_null() {
        unsafe { *count = 1 };
        return vk::Result::SUCCESS;
    }
    unsafe {
        (*to).physical_device_count = 1;
        (*to).physical_devices[0] = super::object::<Instance>(instance).device;
        (*to).subset_allocation = vk::FALSE;
        *count = 1;
    }
    vk::Result::SUCCESS
}
