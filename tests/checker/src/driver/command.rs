//! Command buffers: lists of what to do.

use super::descriptor::Set;
use super::memory::Buffer;
use super::pipeline::Pipeline;
use super::{LOADER_MAGIC, destroy, handle, lock, object, slice};
use crate::machine::Bound;
use ash::vk;
use std::ffi::c_void;
use std::sync::Mutex;

/// What a queue does.
#[derive(Clone)]
pub(super) enum Command {
    /// Workgroups by number.
    Dispatch {
        with: Bindings,
        groups: [u32; 3],
    },
    /// Workgroups by three words in memory.
    Indirect {
        with: Bindings,
        groups: Bound,
    },
    /// Copies as many bytes as the second range has.
    Copy {
        from: Bound,
        to: Bound,
    },
    Fill {
        to: Bound,
        word: u32,
    },
    Reset {
        pool: vk::QueryPool,
        first: u32,
        count: u32,
    },
    Timestamp {
        pool: vk::QueryPool,
        query: u32,
    },
}

/// What a dispatch uses.
#[derive(Clone, Default)]
pub(super) struct Bindings {
    pub(super) pipeline: Option<Pipeline>,
    pub(super) set: vk::DescriptorSet,
    pub(super) push: Vec<u32>,
}

#[derive(Default)]
struct Recording {
    commands: Vec<Command>,
    bindings: Bindings,
}

/// A command buffer.
#[repr(C)]
pub(super) struct CommandBuffer {
    loader: usize,
    recording: Mutex<Recording>,
}

type Pool = Mutex<Vec<vk::CommandBuffer>>;

/// The commands of a buffer.
pub(super) fn commands(buffer: vk::CommandBuffer) -> Vec<Command> {
    // SAFETY: see the head of the parent module, here and in `record`.
    lock(&unsafe { object::<CommandBuffer>(buffer) }.recording).commands.clone()
}

fn record(buffer: vk::CommandBuffer, with: impl FnOnce(&mut Recording)) {
    with(&mut lock(&unsafe { object::<CommandBuffer>(buffer) }.recording));
}

fn add(buffer: vk::CommandBuffer, command: Option<Command>) {
    record(buffer, |recording| recording.commands.extend(command));
}

fn range(buffer: vk::Buffer, offset: u64, bytes: u64) -> Option<Bound> {
    // SAFETY: likewise.
    unsafe { object::<Buffer>(buffer) }.range(offset, bytes)
}

pub(super) unsafe extern "system" fn create_pool(
    _: vk::Device,
    _: *const c_void,
    _: *const c_void,
    to: *mut vk::CommandPool,
) -> vk::Result {
    unsafe { *to = handle(Pool::default()) };
    vk::Result::SUCCESS
}

pub(super) unsafe extern "system" fn destroy_pool(_: vk::Device, pool: vk::CommandPool, _: *const c_void) {
    if pool != vk::CommandPool::null() {
        unsafe {
            lock(object::<Pool>(pool)).drain(..).for_each(|buffer| destroy::<CommandBuffer>(buffer));
            destroy::<Pool>(pool);
        }
    }
}

pub(super) unsafe extern "system" fn allocate(
    _: vk::Device,
    info: *const vk::CommandBufferAllocateInfo<'_>,
    to: *mut vk::CommandBuffer,
) -> vk::Result {
    let info = unsafe { &*info };
    let mut pool = lock(unsafe { object::<Pool>(info.command_pool) });
    for place in 0..info.command_buffer_count as usize {
        let buffer = handle(CommandBuffer { loader: LOADER_MAGIC, recording: Mutex::default() });
        pool.push(buffer);
        unsafe { *to.add(place) = buffer };
    }
    vk::Result::SUCCESS
}

pub(super) unsafe extern "system" fn free(
    _: vk::Device,
    pool: vk::CommandPool,
    count: u32,
    buffers: *const vk::CommandBuffer,
) {
    for &buffer in unsafe { slice(buffers, count) } {
        lock(unsafe { object::<Pool>(pool) }).retain(|other| *other != buffer);
        unsafe { destroy::<CommandBuffer>(buffer) };
    }
}

pub(super) extern "system" fn begin(buffer: vk::CommandBuffer, _: *const c_void) -> vk::Result {
    record(buffer, |recording| *recording = Recording::default());
    vk::Result::SUCCESS
}

pub(super) extern "system" fn end(_: vk::CommandBuffer) -> vk::Result {
    vk::Result::SUCCESS
}

pub(super) extern "system" fn reset(buffer: vk::CommandBuffer, _: vk::CommandBufferResetFlags) -> vk::Result {
    begin(buffer, std::ptr::null())
}

pub(super) unsafe extern "system" fn bind_pipeline(
    buffer: vk::CommandBuffer,
    _: vk::PipelineBindPoint,
    pipeline: vk::Pipeline,
) {
    let pipeline = unsafe { object::<Pipeline>(pipeline) }.clone();
    record(buffer, |recording| recording.bindings.pipeline = Some(pipeline));
}

pub(super) unsafe extern "system" fn bind_sets(
    buffer: vk::CommandBuffer,
    _: vk::PipelineBindPoint,
    _: vk::PipelineLayout,
    _: u32,
    _: u32,
    sets: *const vk::DescriptorSet,
    _: u32,
    _: *const u32,
) {
    let set = unsafe { *sets };
    record(buffer, |recording| recording.bindings.set = set);
}

pub(super) unsafe extern "system" fn push(
    buffer: vk::CommandBuffer,
    _: vk::PipelineLayout,
    _: vk::ShaderStageFlags,
    offset: u32,
    bytes: u32,
    values: *const c_void,
) {
    let values = unsafe { slice(values.cast::<u32>(), bytes / 4) };
    let first = offset as usize / 4;
    record(buffer, |recording| {
        let push = &mut recording.bindings.push;
        push.resize(push.len().max(first + values.len()), 0);
        push[first..first + values.len()].copy_from_slice(values);
    });
}

pub(super) extern "system" fn dispatch(buffer: vk::CommandBuffer, x: u32, y: u32, z: u32) {
    record(buffer, |recording| {
        let with = recording.bindings.clone();
        recording.commands.push(Command::Dispatch { with, groups: [x, y, z] });
    });
}

pub(super) extern "system" fn dispatch_indirect(buffer: vk::CommandBuffer, from: vk::Buffer, offset: u64) {
    record(buffer, |recording| {
        let with = recording.bindings.clone();
        recording.commands.extend(range(from, offset, 12).map(|groups| Command::Indirect { with, groups }));
    });
}

pub(super) unsafe extern "system" fn copy(
    buffer: vk::CommandBuffer,
    from: vk::Buffer,
    to: vk::Buffer,
    count: u32,
    regions: *const vk::BufferCopy,
) {
    for region in unsafe { slice(regions, count) } {
        let ranges = (range(from, region.src_offset, region.size), range(to, region.dst_offset, region.size));
        let (Some(from), Some(to)) = ranges else { continue };
        add(buffer, Some(Command::Copy { from, to }));
    }
}

pub(super) extern "system" fn fill(buffer: vk::CommandBuffer, to: vk::Buffer, offset: u64, bytes: u64, word: u32) {
    add(buffer, range(to, offset, bytes).map(|to| Command::Fill { to, word }));
}

/// Commands run one after the other, so nothing is left to do.
pub(super) extern "system" fn barrier() {}

pub(super) extern "system" fn reset_queries(buffer: vk::CommandBuffer, pool: vk::QueryPool, first: u32, count: u32) {
    add(buffer, Some(Command::Reset { pool, first, count }));
}

pub(super) extern "system" fn timestamp(
    buffer: vk::CommandBuffer,
    _: vk::PipelineStageFlags,
    pool: vk::QueryPool,
    query: u32,
) {
    add(buffer, Some(Command::Timestamp { pool, query }));
}

/// The ranges of a set, in the order of the program's bindings; `None` if one is missing.
pub(super) fn bound(with: &Bindings) -> Option<Vec<Bound>> {
    let pipeline = with.pipeline.as_ref()?;
    // SAFETY: likewise.
    let set = lock(unsafe { object::<Set>(with.set) });
    pipeline.bindings.iter().map(|used| set.get(&used.number).copied()).collect()
}
