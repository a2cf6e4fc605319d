//! Memory, buffers and their views.

use super::device::Device;
use super::properties::{DEVICE_MEMORY, texel_words};
use super::{destroy, handle, lock, object};
use crate::machine::{Bound, Format};
use crate::memory::Memory;
use ash::vk;
use std::cell::Cell;
use std::ffi::c_void;

/// A buffer.
pub(super) struct Buffer {
    bytes: u64,
    /// Place of its memory, and first byte there.
    bound: Cell<Option<(usize, u64)>>,
}

impl Buffer {
    /// A range of its memory.
    pub(super) fn range(&self, offset: u64, bytes: u64) -> Option<Bound> {
        let (memory, start) = self.bound.get()?;
        let bytes = if bytes == vk::WHOLE_SIZE { self.bytes - offset } else { bytes };
        Some(Bound { memory, offset: start + offset, bytes, texels: None })
    }
}

/// A typed view of a buffer.
pub(super) struct View {
    pub(super) bound: Option<Bound>,
}

pub(super) unsafe extern "system" fn allocate(
    device: vk::Device,
    info: *const vk::MemoryAllocateInfo<'_>,
    _: *const c_void,
    to: *mut vk::DeviceMemory,
) -> vk::Result {
    let info = unsafe { &*info };
    let memories = &mut lock(&Device::of(device).state).memories;
    let memory = Memory::new(info.allocation_size, info.memory_type_index != DEVICE_MEMORY);
    let place = memories.iter().position(Option::is_none).unwrap_or_else(|| {
        memories.push(None);
        memories.len() - 1
    });
    memories[place] = Some(memory);
    // A handle of 0 means nothing.
    unsafe { *to = vk::Handle::from_raw(place as u64 + 1) };
    vk::Result::SUCCESS
}

fn place(memory: vk::DeviceMemory) -> usize {
    vk::Handle::as_raw(memory) as usize - 1
}

pub(super) unsafe extern "system" fn free(device: vk::Device, memory: vk::DeviceMemory, _: *const c_void) {
    if memory != vk::DeviceMemory::null() {
        lock(&Device::of(device).state).memories[place(memory)] = None;
    }
}

pub(super) unsafe extern "system" fn map(
    device: vk::Device,
    memory: vk::DeviceMemory,
    offset: u64,
    _: u64,
    _: vk::MemoryMapFlags,
    to: *mut *mut c_void,
) -> vk::Result {
    let state = lock(&Device::of(device).state);
    let Some(found) = &state.memories[place(memory)] else { return vk::Result::ERROR_MEMORY_MAP_FAILED };
    unsafe { *to = found.pointer().add(offset as usize).cast() };
    vk::Result::SUCCESS
}

pub(super) extern "system" fn unmap(_: vk::Device, _: vk::DeviceMemory) {}

pub(super) extern "system" fn flush(_: vk::Device, _: u32, _: *const c_void) -> vk::Result {
    vk::Result::SUCCESS
}

pub(super) unsafe extern "system" fn create_buffer(
    _: vk::Device,
    info: *const vk::BufferCreateInfo<'_>,
    _: *const c_void,
    to: *mut vk::Buffer,
) -> vk::Result {
    unsafe { *to = handle(Buffer { bytes: (*info).size, bound: Cell::new(None) }) };
    vk::Result::SUCCESS
}

pub(super) unsafe extern "system" fn destroy_buffer(_: vk::Device, buffer: vk::Buffer, _: *const c_void) {
    unsafe { destroy::<Buffer>(buffer) };
}

pub(super) unsafe extern "system" fn requirements(_: vk::Device, buffer: vk::Buffer, to: *mut vk::MemoryRequirements) {
    let size = unsafe { object::<Buffer>(buffer) }.bytes.next_multiple_of(64);
    unsafe { *to = vk::MemoryRequirements { size, alignment: 64, memory_type_bits: 3 } };
}

pub(super) unsafe extern "system" fn requirements2(
    device: vk::Device,
    info: *const vk::BufferMemoryRequirementsInfo2<'_>,
    to: *mut vk::MemoryRequirements2<'_>,
) {
    unsafe { requirements(device, (*info).buffer, &mut (*to).memory_requirements) };
}

pub(super) unsafe extern "system" fn bind(
    _: vk::Device,
    buffer: vk::Buffer,
    memory: vk::DeviceMemory,
    offset: u64,
) -> vk::Result {
    unsafe { object::<Buffer>(buffer) }.bound.set(Some((place(memory), offset)));
    vk::Result::SUCCESS
}

pub(super) unsafe extern "system" fn create_view(
    _: vk::Device,
    info: *const vk::BufferViewCreateInfo<'_>,
    _: *const c_void,
    to: *mut vk::BufferView,
) -> vk::Result {
    let info = unsafe { &*info };
    let Some(words) = texel_words(info.format) else { return vk::Result::ERROR_FORMAT_NOT_SUPPORTED };
    let texels = Some(Format { words, is_float: info.format != vk::Format::R32_UINT });
    let range = unsafe { object::<Buffer>(info.buffer) }.range(info.offset, info.range);
    unsafe { *to = handle(View { bound: range.map(|bound| Bound { texels, ..bound }) }) };
    vk::Result::SUCCESS
}

pub(super) unsafe extern "system" fn destroy_view(_: vk::Device, view: vk::BufferView, _: *const c_void) {
    unsafe { destroy::<View>(view) };
}
