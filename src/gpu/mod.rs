//! Opens Vulkan devices: [`Gpu::new`] opens one, [`devices`] lists all with their [`Capabilities`].
//!
//! A thin layer over Vulkan: one instance, one device, one compute queue, an optional transfer queue, and owners of the
//! objects created from them. This module and `scheduler/recorder.rs` uphold Vulkan's requirements on the caller, so
//! the rest of the crate is safe code. Objects hold an `Arc<Gpu>`: no handle outlives its device.
// Vulkan calls are foreign functions: every call is unsafe. Only this module and the recorder make them.
#![allow(unsafe_code)]

mod cache;
mod call;
mod capabilities;
mod command;
mod crash;
mod descriptor;
mod devices;
mod hidden;
mod instance;
pub(crate) mod limits;
mod lock;
mod memory;
mod packed;
mod pipeline;
mod probe;
mod query;
mod select;
mod statistics;
mod timeline;
mod uniform_flow;

pub use cache::PipelineStore;
pub use capabilities::{Capabilities, DeviceKind, Requirement, Subgroup};
pub(crate) use capabilities::{SUBGROUP_MAX, SUBGROUP_MIN};
pub use devices::devices;
pub use instance::{Message, MessageLog, Validation};
pub(crate) use limits::Limits;
pub(crate) use memory::{Buffer, MemoryKind};
pub use statistics::Statistic;

pub(crate) use call::vk_call;
pub(crate) use command::CommandBuffer;
pub(crate) use crash::Markers;
pub(crate) use descriptor::{Binding, BufferView, DescriptorPool};
pub(crate) use packed::stride;
pub(crate) use pipeline::Pipeline;
use pipeline::{PipelineKey, PipelineSlot};
pub(crate) use query::QueryPool;
pub(crate) use timeline::Timeline;

use crate::error::{Error, Result};
use crate::lab;
use ash::vk;
use gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc};
use instance::Instance;
use select::SelectedDevice;
use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard};

/// Options for opening a device.
#[derive(Clone, Debug, Default)]
pub struct GpuOptions {
    /// Index, part of the name, or UUID of the device, or a comma-separated list of these; `None` for the most capable
    /// device. With a list, the first device that no other process has locked is used.
    pub device: Option<String>,
    /// Folder for device locks, created if missing; needed with a list of devices. Processes with the same folder take
    /// different devices. The lock is released when the [`Gpu`] is dropped or the process ends.
    pub locks: Option<PathBuf>,
    /// Validation layer.
    pub validation: Validation,
    /// Enables the driver's bounds checks on every buffer access.
    pub robust_buffer_access: bool,
    /// Subgroup size, a power of two that the device offers; `None` for the device's default.
    pub subgroup_size: Option<u32>,
    /// Emulates subgroups in shared memory, as on devices without usable subgroups. It is slower, but every size from 4
    /// to 64 runs on every device.
    pub emulate_subgroups: bool,
    /// Opens the device only to query statistics of compiled kernels. A compile-only driver without memory is then
    /// accepted.
    pub statistics: bool,
    /// Storage of compiled pipelines between runs; `None` to discard them.
    pub pipelines: Option<Arc<dyn PipelineStore>>,
}

impl GpuOptions {
    /// Reads options from `LABELGS_DEVICE` and `LABELGS_VALIDATION` (`off`, `on`, `sync`, `gpu`); in tests also from
    /// `LABELGS_SUBGROUP_SIZE` and `LABELGS_EMULATE`.
    pub fn from_env() -> Result<Self> {
        let set = |name| std::env::var(name).ok().filter(|value| !value.is_empty());
        let validation = set("LABELGS_VALIDATION").map(|value| value.parse()).transpose()?.unwrap_or_default();
        let subgroup_size = lab::var("LABELGS_SUBGROUP_SIZE")
            .map(|value| value.parse().map_err(|_| Error::usage("LABELGS_SUBGROUP_SIZE", "expected a whole number")))
            .transpose()?;
        let emulate_subgroups = lab::var("LABELGS_EMULATE").is_some();
        Ok(Self { device: set("LABELGS_DEVICE"), validation, subgroup_size, emulate_subgroups, ..Self::default() })
    }
}

/// Queue of a command buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Lane {
    /// Runs lists and all other work.
    Compute,
    /// Copies in parallel to lists; falls back to the compute queue if there is no transfer queue.
    Transfer,
}

/// An opened device.
pub struct Gpu {
    pipelines: Mutex<HashMap<PipelineKey, PipelineSlot>>,
    allocator: Mutex<Option<Allocator>>,
    used: memory::MemoryUse,
    queue: Mutex<vk::Queue>,
    /// The separate transfer queue, if there is one.
    transfer: Option<Mutex<vk::Queue>>,
    names: Option<ash::ext::debug_utils::Device>,
    statistics: Option<statistics::StatisticFunctions>,
    cache: Mutex<cache::PipelineCache>,
    device: ash::Device,
    capabilities: Capabilities,
    _lock: Option<lock::DeviceLock>,
    // Declared last: fields are dropped in this order, and `Drop` destroys the device before them.
    instance: Instance,
}

impl Gpu {
    /// Opens a device. The error lists all devices and the missing features of each.
    pub fn new(options: &GpuOptions) -> Result<Arc<Self>> {
        let instance = Instance::new(options.validation)?;
        let SelectedDevice { physical, mut capabilities, lock } = select::select_device(&instance, options)?;
        capabilities.choose_subgroup(options)?;
        let device = select::open(&instance, physical, &capabilities, options)?;
        // SAFETY: the device has this family and was created with one queue of it.
        let queue = unsafe { device.get_device_queue(capabilities.queue_family, 0) };
        // SAFETY: likewise.
        let transfer =
            capabilities.transfer_family.map(|family| Mutex::new(unsafe { device.get_device_queue(family, 0) }));
        let allocator = Allocator::new(&AllocatorCreateDesc {
            instance: instance.raw().clone(),
            device: device.clone(),
            physical_device: physical,
            debug_settings: gpu_allocator::AllocatorDebugSettings::default(),
            buffer_device_address: false,
            allocation_sizes: gpu_allocator::AllocationSizes::new(64 << 20, 16 << 20),
        });
        let allocator = allocator.map_err(|error| {
            // SAFETY: no object was made from the device yet.
            unsafe { device.destroy_device(None) };
            Error::NoDevice(format!("the memory allocator cannot be created: {error}"))
        })?;
        let names = instance.has_debug_utils().then(|| ash::ext::debug_utils::Device::new(instance.raw(), &device));
        let statistics = options.statistics.then(|| statistics::StatisticFunctions::new(instance.raw(), &device));
        let cache = cache::PipelineCache::new(&device, &capabilities, options.pipelines.as_ref());
        Ok(Arc::new(Self {
            pipelines: Mutex::new(HashMap::new()),
            cache: Mutex::new(cache),
            allocator: Mutex::new(Some(allocator)),
            used: memory::MemoryUse::default(),
            queue: Mutex::new(queue),
            transfer,
            names,
            statistics,
            device,
            capabilities,
            _lock: lock,
            instance,
        }))
    }

    /// Properties and features of the device.
    pub fn capabilities(&self) -> &Capabilities {
        &self.capabilities
    }

    /// Limits of the device.
    #[doc(hidden)]
    pub fn limits(&self) -> &Limits {
        &self.capabilities.limits
    }

    /// Subgroup size of pipelines whose shaders use subgroups.
    pub fn subgroup_size(&self) -> u32 {
        self.capabilities.subgroup.size
    }

    /// True if the device is the CPU.
    pub fn is_cpu(&self) -> bool {
        self.capabilities.is_cpu()
    }

    /// Messages of the validation layer so far.
    pub fn messages(&self) -> Vec<Message> {
        self.instance.log().messages()
    }

    /// Log of the validation layer; it stays readable after the device is destroyed.
    pub fn message_log(&self) -> MessageLog {
        self.instance.log().clone()
    }

    /// True if the validation layer is installed and enabled.
    pub fn is_validated(&self) -> bool {
        self.instance.is_validated()
    }

    /// Waits until the device is idle.
    pub(crate) fn wait_idle(&self) -> Result<()> {
        let (_queue, _transfer) = (lock(&self.queue), self.transfer.as_ref().map(lock));
        // SAFETY: the locks on the queues prevent submits meanwhile.
        vk_call("vkDeviceWaitIdle", || unsafe { self.device.device_wait_idle() })
    }

    /// Submits command buffers to a lane. They start when the timeline of `after` has reached its value, and set the
    /// timeline to `value` when they are done.
    pub(crate) fn submit(
        &self,
        lane: Lane,
        commands: &[&CommandBuffer],
        after: Option<(&Timeline, u64)>,
        (timeline, value): (&Timeline, u64),
    ) -> Result<()> {
        let (semaphores, values) = ([timeline.raw()], [value]);
        let (before, before_values): (Vec<_>, Vec<_>) =
            after.map(|(timeline, value)| (timeline.raw(), value)).into_iter().unzip();
        let stages = [vk::PipelineStageFlags::ALL_COMMANDS];
        let commands: Vec<vk::CommandBuffer> = commands.iter().map(|command| command.raw()).collect();
        let mut values = vk::TimelineSemaphoreSubmitInfo::default()
            .wait_semaphore_values(&before_values)
            .signal_semaphore_values(&values);
        let info = vk::SubmitInfo::default()
            .command_buffers(&commands)
            .wait_semaphores(&before)
            .wait_dst_stage_mask(&stages[..before.len()])
            .signal_semaphores(&semaphores)
            .push_next(&mut values);
        let queue = lock(match (lane, &self.transfer) {
            (Lane::Transfer, Some(queue)) => queue,
            _ => &self.queue,
        });
        // SAFETY: the scheduler submits recorded command buffers that are not pending, with growing values.
        vk_call("vkQueueSubmit", || unsafe { self.device.queue_submit(*queue, &[info], vk::Fence::null()) })
    }

    /// The cache for new pipelines.
    fn pipeline_cache(&self) -> vk::PipelineCache {
        lock(&self.cache).raw()
    }

    /// Device functions, for the modules that may use unsafe code.
    pub(crate) fn raw(&self) -> &ash::Device {
        &self.device
    }

    /// Names an object for messages of the validation layer.
    fn name_object<H: vk::Handle>(&self, handle: H, name: &str) {
        let (Some(names), Ok(name)) = (&self.names, std::ffi::CString::new(name)) else { return };
        let info = vk::DebugUtilsObjectNameInfoEXT::default().object_handle(handle).object_name(&name);
        // SAFETY: the handle is alive. A failure only loses the name.
        let _ = unsafe { names.set_debug_utils_object_name(&info) };
    }
}

impl Drop for Gpu {
    fn drop(&mut self) {
        // A lost device reports an error here; it is destroyed nevertheless. A compile-only driver cannot wait.
        if self.limits().heap > 0 {
            let _ = self.wait_idle();
        }
        lock(&self.pipelines).clear();
        lock(&self.cache).close(&self.device);
        // The allocator frees its blocks through the device's functions, so it is dropped first.
        drop(lock(&self.allocator).take());
        // SAFETY: every object made from the device holds an `Arc` of this, so none is left; pipelines and memory were
        // destroyed above.
        unsafe { self.device.destroy_device(None) };
    }
}

impl std::fmt::Debug for Gpu {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_tuple("Gpu").field(&self.capabilities.name).finish()
    }
}

/// Locks a mutex even after a panic in another thread: the guarded data are valid between any two statements.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}
