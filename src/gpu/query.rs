//! Timestamps.

use super::Gpu;
use super::call::vk_call;
use crate::error::Result;
use ash::vk;
use std::sync::Arc;

/// A pool of timestamps, reset and written by one command buffer.
pub(crate) struct QueryPool {
    gpu: Arc<Gpu>,
    handle: vk::QueryPool,
    count: u32,
}

impl QueryPool {
    pub(crate) fn new(gpu: &Arc<Gpu>, count: u32) -> Result<Self> {
        let info = vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::TIMESTAMP).query_count(count);
        // SAFETY: the device is alive, and the count is not 0.
        let handle = vk_call("vkCreateQueryPool", || unsafe { gpu.raw().create_query_pool(&info, None) })?;
        Ok(Self { gpu: Arc::clone(gpu), handle, count })
    }

    pub(crate) fn raw(&self) -> vk::QueryPool {
        self.handle
    }

    pub(crate) fn count(&self) -> u32 {
        self.count
    }

    /// Returns the nanoseconds between successive timestamps; the command buffer must have finished.
    pub(crate) fn intervals(&self) -> Result<Vec<u64>> {
        let mut ticks = vec![0_u64; self.count as usize];
        let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT;
        // SAFETY: the slice has room for all queries of the pool.
        vk_call("vkGetQueryPoolResults", || unsafe {
            self.gpu.raw().get_query_pool_results(self.handle, 0, &mut ticks, flags)
        })?;
        let limits = self.gpu.limits();
        let mask = u64::MAX >> (64 - limits.timestamp_bits.clamp(1, 64));
        let period = f64::from(limits.timestamp_period);
        Ok(ticks
            .windows(2)
            .map(|pair| (pair[1].wrapping_sub(pair[0]) & mask) as f64 * period)
            .map(|ns| ns as u64)
            .collect())
    }
}

impl Drop for QueryPool {
    fn drop(&mut self) {
        // SAFETY: the scheduler waits for the recordings with this pool before it drops them.
        unsafe { self.gpu.raw().destroy_query_pool(self.handle, None) };
    }
}
