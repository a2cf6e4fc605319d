//! Timeline semaphores and timestamps.

use super::device::Device;
use super::{chain, destroy, handle, lock, object, slice};
use ash::vk;
use std::ffi::c_void;
use std::sync::{Condvar, Mutex};
use std::time::{Duration, Instant};

/// A timeline semaphore.
#[derive(Default)]
pub(super) struct Timeline {
    value: Mutex<u64>,
    grown: Condvar,
}

impl Timeline {
    pub(super) fn set(&self, value: u64) {
        *lock(&self.value) = value;
        self.grown.notify_all();
    }

    /// Waits until the value is reached; returns false after the given time.
    pub(super) fn wait(&self, value: u64, longest: Duration) -> bool {
        let (found, _) = self
            .grown
            .wait_timeout_while(lock(&self.value), longest, |found| *found < value)
            .unwrap_or_else(std::sync::PoisonError::into_inner);
        *found >= value
    }
}

/// Values of queries.
pub(super) type Queries = Mutex<Vec<u64>>;

pub(super) unsafe extern "system" fn create_semaphore(
    _: vk::Device,
    info: *const vk::SemaphoreCreateInfo<'_>,
    _: *const c_void,
    to: *mut vk::Semaphore,
) -> vk::Result {
    let timeline = Timeline::default();
    for next in unsafe { chain((*info).p_next) } {
        if unsafe { (*next).s_type } == vk::StructureType::SEMAPHORE_TYPE_CREATE_INFO {
            timeline.set(unsafe { (*next.cast::<vk::SemaphoreTypeCreateInfo<'_>>()).initial_value });
        }
    }
    unsafe { *to = handle(timeline) };
    vk::Result::SUCCESS
}

pub(super) unsafe extern "system" fn destroy_semaphore(_: vk::Device, semaphore: vk::Semaphore, _: *const c_void) {
    unsafe { destroy::<Timeline>(semaphore) };
}

pub(super) unsafe extern "system" fn counter(device: vk::Device, semaphore: vk::Semaphore, to: *mut u64) -> vk::Result {
    unsafe { *to = *lock(&object::<Timeline>(semaphore).value) };
    Device::of(device).result()
}

pub(super) unsafe extern "system" fn wait(
    device: vk::Device,
    info: *const vk::SemaphoreWaitInfo<'_>,
    nanoseconds: u64,
) -> vk::Result {
    let info = unsafe { &*info };
    let start = Instant::now();
    let semaphores = unsafe { slice(info.p_semaphores, info.semaphore_count) };
    let values = unsafe { slice(info.p_values, info.semaphore_count) };
    for (semaphore, value) in semaphores.iter().zip(values) {
        let timeline = unsafe { object::<Timeline>(*semaphore) };
        // A device that is lost meanwhile signals nothing more.
        while !timeline.wait(*value, Duration::from_millis(5)) {
            if Device::of(device).result() != vk::Result::SUCCESS {
                return vk::Result::ERROR_DEVICE_LOST;
            }
            if start.elapsed() > Duration::from_nanos(nanoseconds) {
                return vk::Result::TIMEOUT;
            }
        }
    }
    Device::of(device).result()
}

pub(super) unsafe extern "system" fn signal(_: vk::Device, info: *const vk::SemaphoreSignalInfo<'_>) -> vk::Result {
    unsafe { object::<Timeline>((*info).semaphore).set((*info).value) };
    vk::Result::SUCCESS
}

pub(super) unsafe extern "system" fn create_queries(
    _: vk::Device,
    info: *const vk::QueryPoolCreateInfo<'_>,
    _: *const c_void,
    to: *mut vk::QueryPool,
) -> vk::Result {
    unsafe { *to = handle(Queries::new(vec![0; (*info).query_count as usize])) };
    vk::Result::SUCCESS
}

pub(super) unsafe extern "system" fn destroy_queries(_: vk::Device, pool: vk::QueryPool, _: *const c_void) {
    unsafe { destroy::<Queries>(pool) };
}

/// Results of 64 bits.
pub(super) unsafe extern "system" fn results(
    device: vk::Device,
    pool: vk::QueryPool,
    first: u32,
    count: u32,
    _: usize,
    data: *mut c_void,
    stride: u64,
    _: vk::QueryResultFlags,
) -> vk::Result {
    let values = lock(unsafe { object::<Queries>(pool) });
    for place in 0..count as usize {
        let to = unsafe { data.cast::<u8>().add(place * stride as usize).cast::<u64>() };
        unsafe { to.write_unaligned(values[first as usize + place]) };
    }
    Device::of(device).result()
}
