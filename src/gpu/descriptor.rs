//! Descriptor sets, written once, and their texel views.

use super::Gpu;
use super::call::vk_call;
use super::memory::Buffer;
use super::pipeline::Pipeline;
use crate::error::Result;
use ash::vk;
use std::sync::Arc;

/// A typed view of a range of a buffer.
pub(crate) struct BufferView {
    gpu: Arc<Gpu>,
    handle: vk::BufferView,
}

impl BufferView {
    pub(crate) fn new(gpu: &Arc<Gpu>, buffer: &Buffer, format: vk::Format, offset: u64, bytes: u64) -> Result<Self> {
        let info = vk::BufferViewCreateInfo::default().buffer(buffer.raw()).format(format);
        let info = info.offset(buffer.start() + offset).range(bytes);
        // SAFETY: the planner aligned the offset and checked the size; every device supports all four formats.
        let handle = vk_call("vkCreateBufferView", || unsafe { gpu.raw().create_buffer_view(&info, None) })?;
        Ok(Self { gpu: Arc::clone(gpu), handle })
    }
}

impl Drop for BufferView {
    fn drop(&mut self) {
        // SAFETY: the scheduler waits for the recordings with this view before it drops them.
        unsafe { self.gpu.raw().destroy_buffer_view(self.handle, None) };
    }
}

/// A resource for a descriptor.
pub(crate) enum Binding<'a> {
    /// A range of a buffer.
    Storage {
        /// The buffer.
        buffer: &'a Buffer,
        /// First byte.
        offset: u64,
        /// Number of bytes.
        bytes: u64,
    },
    /// A range of a buffer that shaders read as uniforms.
    Uniform {
        /// The buffer.
        buffer: &'a Buffer,
        /// First byte.
        offset: u64,
        /// Number of bytes.
        bytes: u64,
    },
    /// A typed view.
    Texel(&'a BufferView),
}

/// A pool with exactly the sets of one recording.
pub(crate) struct DescriptorPool {
    gpu: Arc<Gpu>,
    handle: vk::DescriptorPool,
}

impl DescriptorPool {
    pub(crate) fn new(gpu: &Arc<Gpu>, sets: u32, storage: u32, texel: u32) -> Result<Self> {
        let uniform = if gpu.limits().plan.is_packed() { sets } else { 0 };
        let sizes = [
            (vk::DescriptorType::STORAGE_BUFFER, storage),
            (vk::DescriptorType::UNIFORM_TEXEL_BUFFER, texel),
            (vk::DescriptorType::UNIFORM_BUFFER, uniform),
        ];
        let sizes = sizes.iter().filter(|(_, count)| *count > 0);
        let sizes =
            sizes.map(|&(ty, descriptor_count)| vk::DescriptorPoolSize { ty, descriptor_count }).collect::<Vec<_>>();
        let info = vk::DescriptorPoolCreateInfo::default().max_sets(sets.max(1)).pool_sizes(&sizes);
        // SAFETY: the device is alive.
        let handle = vk_call("vkCreateDescriptorPool", || unsafe { gpu.raw().create_descriptor_pool(&info, None) })?;
        Ok(Self { gpu: Arc::clone(gpu), handle })
    }

    /// Allocates a set of the pipeline and writes its bindings, in the order of the pipeline's.
    pub(crate) fn set(&self, pipeline: &Pipeline, bindings: &[Binding<'_>]) -> Result<vk::DescriptorSet> {
        let layouts = [pipeline.set_layout()];
        let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(self.handle).set_layouts(&layouts);
        // SAFETY: the pool is used here only, and the layout is alive.
        let sets = vk_call("vkAllocateDescriptorSets", || unsafe { self.gpu.raw().allocate_descriptor_sets(&info) })?;
        let set = sets.first().copied().unwrap_or_default();
        let buffers = bindings
            .iter()
            .map(|binding| match binding {
                Binding::Storage { buffer, offset, bytes } | Binding::Uniform { buffer, offset, bytes } => {
                    let offset = buffer.start() + offset;
                    [vk::DescriptorBufferInfo { buffer: buffer.raw(), offset, range: *bytes }]
                }
                Binding::Texel(_) => [vk::DescriptorBufferInfo::default()],
            })
            .collect::<Vec<_>>();
        let views = bindings
            .iter()
            .map(|binding| match binding {
                Binding::Storage { .. } | Binding::Uniform { .. } => [vk::BufferView::null()],
                Binding::Texel(view) => [view.handle],
            })
            .collect::<Vec<_>>();
        let writes = bindings.iter().zip(pipeline.slots()).enumerate().map(|(index, (binding, &(number, kind)))| {
            let write = vk::WriteDescriptorSet::default().dst_set(set).dst_binding(number).descriptor_count(1);
            let write = write.descriptor_type(kind);
            match binding {
                Binding::Storage { .. } | Binding::Uniform { .. } => write.buffer_info(&buffers[index]),
                Binding::Texel(_) => write.texel_buffer_view(&views[index]),
            }
        });
        let writes = writes.collect::<Vec<_>>();
        // SAFETY: the set is new and not in use; the recording's owner keeps buffers and views alive.
        unsafe { self.gpu.raw().update_descriptor_sets(&writes, &[]) };
        Ok(set)
    }
}

impl Drop for DescriptorPool {
    fn drop(&mut self) {
        // SAFETY: the scheduler waits for the recordings with these sets before it drops them.
        unsafe { self.gpu.raw().destroy_descriptor_pool(self.handle, None) };
    }
}
