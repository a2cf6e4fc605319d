//! Timeline semaphores: a counter that grows as submits finish.

use super::Gpu;
use super::call::vk_call;
use crate::error::Result;
use ash::vk;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Longest time that a wait polls before it sleeps.
const POLLING_TIME_MAX: Duration = Duration::from_micros(200);

/// A timeline semaphore that starts at 0.
pub(crate) struct Timeline {
    gpu: Arc<Gpu>,
    handle: vk::Semaphore,
}

impl Timeline {
    pub(crate) fn new(gpu: &Arc<Gpu>) -> Result<Self> {
        let mut kind = vk::SemaphoreTypeCreateInfo::default().semaphore_type(vk::SemaphoreType::TIMELINE);
        let info = vk::SemaphoreCreateInfo::default().push_next(&mut kind);
        // SAFETY: every device must have this feature, and it is enabled.
        let handle = vk_call("vkCreateSemaphore", || unsafe { gpu.raw().create_semaphore(&info, None) })?;
        Ok(Self { gpu: Arc::clone(gpu), handle })
    }

    pub(super) fn raw(&self) -> vk::Semaphore {
        self.handle
    }

    /// Returns true if the value is reached.
    pub(crate) fn is_reached(&self, value: u64) -> Result<bool> {
        // SAFETY: the handle is alive.
        let found = vk_call("vkGetSemaphoreCounterValue", || unsafe {
            self.gpu.raw().get_semaphore_counter_value(self.handle)
        })?;
        Ok(found >= value)
    }

    /// Waits until the value is reached. Polls for a while first, unless the device is the CPU, because a sleeping
    /// thread wakes up 30 to 60 us late.
    pub(crate) fn wait(&self, value: u64) -> Result<()> {
        let start = Instant::now();
        while !self.gpu.is_cpu() && start.elapsed() < POLLING_TIME_MAX {
            if self.is_reached(value)? {
                return Ok(());
            }
            std::hint::spin_loop();
        }
        let (handles, values) = ([self.handle], [value]);
        let info = vk::SemaphoreWaitInfo::default().semaphores(&handles).values(&values);
        // SAFETY: the handle is alive.
        vk_call("vkWaitSemaphores", || unsafe { self.gpu.raw().wait_semaphores(&info, u64::MAX) })
    }
}

impl Drop for Timeline {
    fn drop(&mut self) {
        // SAFETY: the scheduler waits for its submits before it drops its timeline.
        unsafe { self.gpu.raw().destroy_semaphore(self.handle, None) };
    }
}
