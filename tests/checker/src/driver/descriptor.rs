//! Descriptor sets: a range of memory for each binding.

use super::memory::{Buffer, View};
use super::{destroy, handle, lock, object, slice};
use crate::machine::Bound;
use ash::vk;
use std::collections::HashMap;
use std::ffi::c_void;
use std::sync::Mutex;

/// Ranges by number of the binding.
pub(super) type Set = Mutex<HashMap<u32, Bound>>;

/// Sets that end with their pool.
type Pool = Mutex<Vec<vk::DescriptorSet>>;

pub(super) unsafe extern "system" fn create_layout(
    _: vk::Device,
    _: *const c_void,
    _: *const c_void,
    to: *mut vk::DescriptorSetLayout,
) -> vk::Result {
    unsafe { *to = handle(0_u8) };
    vk::Result::SUCCESS
}

pub(super) unsafe extern "system" fn destroy_layout(_: vk::Device, layout: vk::DescriptorSetLayout, _: *const c_void) {
    unsafe { destroy::<u8>(layout) };
}

pub(super) unsafe extern "system" fn create_pool(
    _: vk::Device,
    _: *const c_void,
    _: *const c_void,
    to: *mut vk::DescriptorPool,
) -> vk::Result {
    unsafe { *to = handle(Pool::default()) };
    vk::Result::SUCCESS
}

pub(super) unsafe extern "system" fn destroy_pool(_: vk::Device, pool: vk::DescriptorPool, _: *const c_void) {
    if pool != vk::DescriptorPool::null() {
        unsafe {
            lock(object::<Pool>(pool)).drain(..).for_each(|set| destroy::<Set>(set));
            destroy::<Pool>(pool);
        }
    }
}

pub(super) unsafe extern "system" fn allocate(
    _: vk::Device,
    info: *const vk::DescriptorSetAllocateInfo<'_>,
    to: *mut vk::DescriptorSet,
) -> vk::Result {
    let info = unsafe { &*info };
    let mut pool = lock(unsafe { object::<Pool>(info.descriptor_pool) });
    for place in 0..info.descriptor_set_count as usize {
        let set = handle(Set::default());
        pool.push(set);
        unsafe { *to.add(place) = set };
    }
    vk::Result::SUCCESS
}

pub(super) unsafe extern "system" fn update(
    _: vk::Device,
    count: u32,
    writes: *const vk::WriteDescriptorSet<'_>,
    _: u32,
    _: *const c_void,
) {
    for write in unsafe { slice(writes, count) } {
        let range = if write.descriptor_type == vk::DescriptorType::UNIFORM_TEXEL_BUFFER {
            let view = unsafe { *write.p_texel_buffer_view };
            unsafe { object::<View>(view) }.bound
        } else {
            let info = unsafe { &*write.p_buffer_info };
            unsafe { object::<Buffer>(info.buffer) }.range(info.offset, info.range)
        };
        if let Some(range) = range {
            lock(unsafe { object::<Set>(write.dst_set) }).insert(write.dst_binding, range);
        }
    }
}
