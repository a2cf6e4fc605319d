//! Command buffers.

use super::call::vk_call;
use super::{Gpu, Lane};
use ash::vk;
use std::sync::Arc;

use crate::error::Result;

/// A primary command buffer with its own pool, so no other code has to synchronise with it.
pub(crate) struct CommandBuffer {
    gpu: Arc<Gpu>,
    pool: vk::CommandPool,
    handle: vk::CommandBuffer,
}

impl CommandBuffer {
    pub(crate) fn new(gpu: &Arc<Gpu>, lane: Lane) -> Result<Self> {
        let own = gpu.capabilities.transfer_family.filter(|_| lane == Lane::Transfer);
        let info = vk::CommandPoolCreateInfo::default()
            .queue_family_index(own.unwrap_or(gpu.capabilities.queue_family))
            .flags(vk::CommandPoolCreateFlags::RESET_COMMAND_BUFFER);
        // SAFETY: the device was created with this family.
        let pool = vk_call("vkCreateCommandPool", || unsafe { gpu.raw().create_command_pool(&info, None) })?;
        let mut command = Self { gpu: Arc::clone(gpu), pool, handle: vk::CommandBuffer::null() };
        let info = vk::CommandBufferAllocateInfo::default()
            .command_pool(pool)
            .level(vk::CommandBufferLevel::PRIMARY)
            .command_buffer_count(1);
        // SAFETY: the pool is new and used here only.
        let handles = vk_call("vkAllocateCommandBuffers", || unsafe { gpu.raw().allocate_command_buffers(&info) })?;
        command.handle = handles.first().copied().unwrap_or_default();
        Ok(command)
    }

    pub(crate) fn raw(&self) -> vk::CommandBuffer {
        self.handle
    }
}

impl Drop for CommandBuffer {
    fn drop(&mut self) {
        // SAFETY: the scheduler waits for its submits before it drops a command buffer; the pool frees it.
        unsafe { self.gpu.raw().destroy_command_pool(self.pool, None) };
    }
}
