//! Records commands. No other code dispatches or places barriers.
//!
//! This module checks the planner's results against the device limits again, because an invalid command buffer is
//! undefined behaviour for the whole process.
// Vulkan commands are foreign functions: every call is unsafe.
#![allow(unsafe_code)]
#![expect(clippy::disallowed_methods, reason = "the place that records dispatches and barriers")]

use crate::error::{Error, Result};
use crate::gpu::{Buffer, CommandBuffer, Gpu, Pipeline, QueryPool, vk_call};
use crate::scheduler::plan::{Use, Uses};
use crate::shaders::PUSHED_WORDS;
use ash::vk;

/// Workgroups of a dispatch, with the resolved buffer.
pub(super) enum Groups<'a> {
    /// Known when the list is recorded.
    Count([u32; 3]),
    /// Read by the device at this byte offset of the buffer.
    Indirect(&'a Buffer, u64),
}

/// Writes one command buffer.
pub(super) struct Recorder<'a> {
    gpu: &'a Gpu,
    command: vk::CommandBuffer,
}

impl<'a> Recorder<'a> {
    /// Begins a recording with a full barrier, which makes all earlier submits and host writes visible to it.
    pub(super) fn begin(gpu: &'a Gpu, command: &CommandBuffer) -> Result<Self> {
        let command = command.raw();
        let info = vk::CommandBufferBeginInfo::default();
        // SAFETY: the command buffer is not pending: it is new, or the scheduler waited for it.
        vk_call("vkBeginCommandBuffer", || unsafe { gpu.raw().begin_command_buffer(command, &info) })?;
        let recorder = Self { gpu, command };
        recorder.memory_barrier(
            (vk::PipelineStageFlags::ALL_COMMANDS | vk::PipelineStageFlags::HOST, vk::PipelineStageFlags::ALL_COMMANDS),
            vk::AccessFlags::MEMORY_WRITE | vk::AccessFlags::HOST_WRITE,
            vk::AccessFlags::MEMORY_READ | vk::AccessFlags::MEMORY_WRITE,
        );
        Ok(recorder)
    }

    /// Makes all writes visible to the host and ends the recording.
    pub(super) fn end(self) -> Result<()> {
        self.memory_barrier(
            (vk::PipelineStageFlags::ALL_COMMANDS, vk::PipelineStageFlags::HOST),
            vk::AccessFlags::MEMORY_WRITE,
            vk::AccessFlags::HOST_READ,
        );
        // SAFETY: begun in `begin`.
        vk_call("vkEndCommandBuffer", || unsafe { self.gpu.raw().end_command_buffer(self.command) })
    }

    /// Orders all earlier commands before all later ones, for these kinds of use.
    pub(super) fn barrier(&self, src: Uses, dst: Uses) {
        let (src_stages, src_access) = masks(src, true);
        let (dst_stages, dst_access) = masks(dst, false);
        self.memory_barrier((src_stages, dst_stages), src_access, dst_access);
    }

    fn memory_barrier(
        &self,
        (src_stages, dst_stages): (vk::PipelineStageFlags, vk::PipelineStageFlags),
        src: vk::AccessFlags,
        dst: vk::AccessFlags,
    ) {
        let barriers = [vk::MemoryBarrier::default().src_access_mask(src).dst_access_mask(dst)];
        // SAFETY: recording; stages and accesses belong to a compute queue.
        unsafe {
            self.gpu.raw().cmd_pipeline_barrier(
                self.command,
                src_stages,
                dst_stages,
                vk::DependencyFlags::empty(),
                &barriers,
                &[],
                &[],
            );
        }
    }

    /// Sets every word of a range.
    pub(super) fn fill(&self, buffer: &Buffer, offset: u64, bytes: u64, word: u32) -> Result<()> {
        check_range(buffer, offset, bytes)?;
        // SAFETY: recording; the range is aligned and inside the buffer, as checked above.
        unsafe { self.gpu.raw().cmd_fill_buffer(self.command, buffer.raw(), buffer.start() + offset, bytes, word) };
        Ok(())
    }

    /// Copies a range of one buffer to another.
    pub(super) fn copy(&self, from: (&Buffer, u64), to: (&Buffer, u64), bytes: u64) -> Result<()> {
        check_range(from.0, from.1, bytes)?;
        check_range(to.0, to.1, bytes)?;
        let (src, dst) = (from.0.start() + from.1, to.0.start() + to.1);
        let overlap = from.0.raw() == to.0.raw() && src < dst + bytes && dst < src + bytes;
        if overlap {
            return Err(Error::Bug(format!("copy within {:?}: the two ranges overlap", from.0)));
        }
        let regions = [vk::BufferCopy { src_offset: src, dst_offset: dst, size: bytes }];
        // SAFETY: recording; the ranges are inside the buffers and do not overlap, as checked above.
        unsafe { self.gpu.raw().cmd_copy_buffer(self.command, from.0.raw(), to.0.raw(), &regions) };
        Ok(())
    }

    /// Dispatches a shader with its push constants.
    pub(super) fn dispatch(
        &self,
        pipeline: &Pipeline,
        set: vk::DescriptorSet,
        pushed: Option<[u32; PUSHED_WORDS]>,
        groups: &Groups<'_>,
    ) -> Result<()> {
        let (raw, command, limits) = (self.gpu.raw(), self.command, self.gpu.limits().plan);
        match groups {
            Groups::Count(count) if count.iter().zip(&limits.max_groups).any(|(count, limit)| count > limit) => {
                return Err(Error::Bug(format!(
                    "{count:?} workgroups; the device supports at most {:?}",
                    limits.max_groups
                )));
            }
            Groups::Count(_) => {}
            Groups::Indirect(buffer, offset) => check_range(buffer, *offset, 12)?,
        }
        // SAFETY: recording; pipeline, set and buffers outlive the recording (the scheduler owns them), the layouts
        // come from the same shader, and counts and ranges are checked above.
        unsafe {
            raw.cmd_bind_pipeline(command, vk::PipelineBindPoint::COMPUTE, pipeline.raw());
            raw.cmd_bind_descriptor_sets(command, vk::PipelineBindPoint::COMPUTE, pipeline.layout(), 0, &[set], &[]);
            if let Some(words) = &pushed {
                let bytes = bytemuck::cast_slice(words);
                raw.cmd_push_constants(command, pipeline.layout(), vk::ShaderStageFlags::COMPUTE, 0, bytes);
            }
            match groups {
                Groups::Count([x, y, z]) => raw.cmd_dispatch(command, *x, *y, *z),
                Groups::Indirect(buffer, offset) => {
                    raw.cmd_dispatch_indirect(command, buffer.raw(), buffer.start() + *offset);
                }
            }
        }
        Ok(())
    }

    /// Resets a pool of timestamps; must run before the first is written.
    pub(super) fn reset_timestamps(&self, pool: &QueryPool) {
        // SAFETY: recording; the pool outlives the recording.
        unsafe { self.gpu.raw().cmd_reset_query_pool(self.command, pool.raw(), 0, pool.count()) };
    }

    /// Writes a timestamp after all earlier commands are done.
    pub(super) fn timestamp(&self, pool: &QueryPool, index: u32) -> Result<()> {
        if index >= pool.count() {
            return Err(Error::Bug(format!("timestamp {index} is out of range: the pool has {}", pool.count())));
        }
        let stage = vk::PipelineStageFlags::BOTTOM_OF_PIPE;
        // SAFETY: recording; the index is inside the pool, which was reset at the start.
        unsafe { self.gpu.raw().cmd_write_timestamp(self.command, stage, pool.raw(), index) };
        Ok(())
    }
}

fn check_range(buffer: &Buffer, offset: u64, bytes: u64) -> Result<()> {
    let inside = offset.checked_add(bytes).is_some_and(|end| end <= buffer.bytes());
    if inside && bytes > 0 && offset.is_multiple_of(4) && bytes.is_multiple_of(4) {
        return Ok(());
    }
    Err(Error::Bug(format!(
        "{bytes} bytes at offset {offset} of {buffer:?} are not a range of words inside the buffer"
    )))
}

/// Stages and accesses of kinds of use. On the source side, reads need no access mask: they leave nothing to flush.
fn masks(uses: Uses, is_src: bool) -> (vk::PipelineStageFlags, vk::AccessFlags) {
    let (mut stages, mut access) = (vk::PipelineStageFlags::empty(), vk::AccessFlags::empty());
    for kind in Use::ALL.into_iter().filter(|kind| uses.contains(*kind)) {
        let (stage, kinds) = match kind {
            Use::ShaderRead => (vk::PipelineStageFlags::COMPUTE_SHADER, vk::AccessFlags::SHADER_READ),
            Use::ShaderWrite => (vk::PipelineStageFlags::COMPUTE_SHADER, vk::AccessFlags::SHADER_WRITE),
            Use::IndirectRead => (vk::PipelineStageFlags::DRAW_INDIRECT, vk::AccessFlags::INDIRECT_COMMAND_READ),
            Use::TransferRead => (vk::PipelineStageFlags::TRANSFER, vk::AccessFlags::TRANSFER_READ),
            Use::TransferWrite => (vk::PipelineStageFlags::TRANSFER, vk::AccessFlags::TRANSFER_WRITE),
        };
        stages |= stage;
        if !is_src || kind.writes() {
            access |= kinds;
        }
    }
    (stages, access)
}
