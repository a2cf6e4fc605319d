//! Buffers and their memory.

use super::call::{fault, vk_call};
use super::{Gpu, lock};
use crate::error::{Error, Result, Setting};
use ash::vk;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme};
use gpu_allocator::{AllocationError, MemoryLocation};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Who accesses a buffer's memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum MemoryKind {
    /// The device only.
    Device,
    /// Written by the host, read by the device.
    Upload,
    /// Written by the device, read by the host.
    Download,
}

/// Bytes of all buffers.
#[derive(Debug, Default)]
pub(super) struct MemoryUse {
    now: AtomicU64,
    peak: AtomicU64,
}

impl MemoryUse {
    fn add(&self, bytes: u64) {
        let now = self.now.fetch_add(bytes, Ordering::Relaxed) + bytes;
        self.peak.fetch_max(now, Ordering::Relaxed);
    }

    fn subtract(&self, bytes: u64) {
        self.now.fetch_sub(bytes, Ordering::Relaxed);
    }
}

impl Gpu {
    /// Returns the peak total size of all buffers since the device was opened, in bytes.
    pub fn peak_memory(&self) -> u64 {
        self.used.peak.load(Ordering::Relaxed)
    }
}

/// A buffer with its memory, or a sub-range of another buffer; freed when dropped.
pub(crate) struct Buffer {
    gpu: Arc<Gpu>,
    name: String,
    handle: vk::Buffer,
    bytes: u64,
    allocation: Option<Allocation>,
    /// For a sub-range: the buffer that owns handle and memory, and the first byte in it.
    whole: Option<(Arc<Buffer>, u64)>,
}

impl Buffer {
    /// Allocates a buffer.
    pub(crate) fn new(gpu: &Arc<Gpu>, name: &str, bytes: u64, kind: MemoryKind) -> Result<Self> {
        let usage = vk::BufferUsageFlags::STORAGE_BUFFER
            | vk::BufferUsageFlags::UNIFORM_TEXEL_BUFFER
            | vk::BufferUsageFlags::INDIRECT_BUFFER
            | vk::BufferUsageFlags::TRANSFER_SRC
            | vk::BufferUsageFlags::TRANSFER_DST;
        let is_packed = gpu.limits().plan.is_packed();
        let usage = if is_packed { usage | vk::BufferUsageFlags::UNIFORM_BUFFER } else { usage };
        let families: Vec<u32> =
            gpu.capabilities.transfer_family.into_iter().chain([gpu.capabilities.queue_family]).collect();
        // Concurrent sharing costs nothing for buffers, unlike images.
        let sharing = if families.len() > 1 { vk::SharingMode::CONCURRENT } else { vk::SharingMode::EXCLUSIVE };
        let shared_by = if families.len() > 1 { &families[..] } else { &[] };
        let info = vk::BufferCreateInfo::default()
            .size(bytes)
            .usage(usage)
            .sharing_mode(sharing)
            .queue_family_indices(shared_by);
        // SAFETY: the device is alive and the size is not 0 (the planner reserves at least one element).
        let handle = vk_call("vkCreateBuffer", || unsafe { gpu.raw().create_buffer(&info, None) })?;
        // From here on, dropping `buffer` destroys the handle.
        let of = (Arc::clone(gpu), name.to_owned());
        let mut buffer = Self { gpu: of.0, name: of.1, handle, bytes, allocation: None, whole: None };
        // SAFETY: this device just created the handle.
        let requirements = unsafe { gpu.raw().get_buffer_memory_requirements(handle) };
        let location = match kind {
            MemoryKind::Device => MemoryLocation::GpuOnly,
            MemoryKind::Upload => MemoryLocation::CpuToGpu,
            MemoryKind::Download => MemoryLocation::GpuToCpu,
        };
        let scheme = AllocationScheme::GpuAllocatorManaged;
        let wanted = AllocationCreateDesc { name, requirements, location, linear: true, allocation_scheme: scheme };
        let allocated = match (fault("vkAllocateMemory"), lock(&gpu.allocator).as_mut()) {
            (Some(vk::Result::ERROR_OUT_OF_DEVICE_MEMORY), _) => Err(AllocationError::OutOfMemory),
            (Some(other), _) => {
                Err(AllocationError::Internal(format!("Unexpected error in vkAllocateMemory: {other:?}")))
            }
            (None, Some(allocator)) => allocator.allocate(&wanted),
            (None, None) => Err(AllocationError::Internal("the device is being destroyed".to_owned())),
        };
        let allocation = allocated.map_err(|error| buffer.refused(error))?;
        let allocation = buffer.allocation.insert(allocation);
        gpu.used.add(allocation.size());
        // SAFETY: new memory of the right type and size; nothing else is bound to it or to the buffer.
        vk_call("vkBindBufferMemory", || unsafe {
            gpu.raw().bind_buffer_memory(handle, allocation.memory(), allocation.offset())
        })?;
        gpu.name_object(handle, name);
        Ok(buffer)
    }

    /// Makes a sub-range of a buffer, and keeps the buffer alive.
    pub(crate) fn part(whole: &Arc<Self>, name: &str, start: u64, bytes: u64) -> Result<Self> {
        if bytes == 0 || start.checked_add(bytes).is_none_or(|end| end > whole.bytes) {
            return Err(Error::Bug(format!("{bytes} bytes at {start} for {name} are outside of {whole:?}")));
        }
        let (gpu, name, handle) = (Arc::clone(&whole.gpu), name.to_owned(), whole.handle);
        Ok(Self { gpu, name, handle, bytes, allocation: None, whole: Some((Arc::clone(whole), start)) })
    }

    fn refused(&self, error: AllocationError) -> Error {
        match error {
            AllocationError::OutOfMemory
            | AllocationError::NoCompatibleMemoryTypeFound
            | AllocationError::FailedToMap(_) => Error::OutOfMemory {
                what: self.name.clone(),
                needed: self.bytes,
                limit_name: "the largest heap of this device (not all of it is free any more)".to_owned(),
                limit: self.gpu.limits().heap,
                cure: format!("lower {}, use smaller images or free memory of the device", Setting("max_gaussians")),
            },
            // The allocator reports some failures only by the name of the result.
            AllocationError::Internal(text) if text.contains("DEVICE_LOST") => {
                Error::DeviceLost { pass: "unknown".to_owned() }
            }
            AllocationError::Internal(text) => {
                // Drivers should not return the last two here; if one does, the driver is at fault, not this program.
                let known = [
                    vk::Result::ERROR_OUT_OF_HOST_MEMORY,
                    vk::Result::ERROR_TOO_MANY_OBJECTS,
                    vk::Result::ERROR_INITIALIZATION_FAILED,
                    vk::Result::ERROR_UNKNOWN,
                ];
                match known.into_iter().find(|result| text.contains(&format!("{result:?}"))) {
                    Some(result) => Error::Vulkan { call: "vkAllocateMemory", result },
                    None => Error::Bug(format!("memory of {}: {text}", self.name)),
                }
            }
            other => Error::Bug(format!("memory of {}: {other}", self.name)),
        }
    }

    /// Size in bytes.
    pub(crate) fn bytes(&self) -> u64 {
        self.bytes
    }

    /// The handle, for descriptors and commands, which count bytes from [`Self::start`].
    pub(crate) fn raw(&self) -> vk::Buffer {
        self.handle
    }

    /// The buffer of which this is a part, or itself.
    pub(crate) fn whole(&self) -> &Self {
        self.whole.as_ref().map_or(self, |(whole, _)| whole)
    }

    /// First byte in the handle's buffer: 0 except for sub-ranges.
    pub(crate) fn start(&self) -> u64 {
        self.whole.as_ref().map_or(0, |(_, start)| *start)
    }

    /// Copies bytes to host-visible memory. The caller ensures that the device does not use them meanwhile.
    pub(crate) fn write(&self, offset: u64, data: &[u8]) -> Result<()> {
        let to = self.mapped(offset, data.len())?;
        // SAFETY: `mapped` checked the range. A Rust slice of the same length cannot overlap device memory.
        unsafe { std::ptr::copy_nonoverlapping(data.as_ptr(), to, data.len()) };
        Ok(())
    }

    /// Copies bytes from host-visible memory. The caller ensures that the device does not write them meanwhile.
    pub(crate) fn read(&self, offset: u64, data: &mut [u8]) -> Result<()> {
        let from = self.mapped(offset, data.len())?;
        // SAFETY: same as in `write`.
        unsafe { std::ptr::copy_nonoverlapping(from.cast_const(), data.as_mut_ptr(), data.len()) };
        Ok(())
    }

    fn mapped(&self, offset: u64, length: usize) -> Result<*mut u8> {
        let inside = offset.checked_add(length as u64).is_some_and(|end| end <= self.bytes);
        if let (true, Some((whole, start))) = (inside, &self.whole) {
            return whole.mapped(start + offset, length);
        }
        let pointer = self.allocation.as_ref().and_then(Allocation::mapped_ptr);
        match pointer {
            // SAFETY: the offset is inside the mapped range, as checked above.
            Some(pointer) if inside => Ok(unsafe { pointer.as_ptr().cast::<u8>().add(offset as usize) }),
            Some(_) => Err(Error::Bug(format!("{length} bytes at offset {offset} exceed buffer {}", self.name))),
            None => Err(Error::Bug(format!("memory of {} is not visible to the host", self.name))),
        }
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        if self.whole.is_some() {
            return;
        }
        // SAFETY: created by this device; the scheduler waits for the device before it drops buffers.
        unsafe { self.gpu.raw().destroy_buffer(self.handle, None) };
        if let (Some(allocation), Some(allocator)) = (self.allocation.take(), lock(&self.gpu.allocator).as_mut()) {
            self.gpu.used.subtract(allocation.size());
            // Freeing only fails for memory of another allocator.
            let _ = allocator.free(allocation);
        }
    }
}

impl std::fmt::Debug for Buffer {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "Buffer({}, {} bytes)", self.name, self.bytes)
    }
}
