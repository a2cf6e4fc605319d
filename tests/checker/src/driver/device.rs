//! The device, its queues, and the state that all submits share.

use super::{Function, LOADER_MAGIC, destroy as drop_object, handle, lock, object};
use crate::machine::Memories;
use crate::races::Races;
use ash::vk;
use std::ffi::{CStr, c_char, c_void};
use std::sync::Mutex;

/// A device.
#[repr(C)]
pub(super) struct Device {
    loader: usize,
    queues: [vk::Queue; 2],
    pub(super) state: Mutex<State>,
}

/// A queue.
#[repr(C)]
pub(super) struct Queue {
    loader: usize,
    pub(super) device: *const Device,
}

/// What submits work on.
#[derive(Default)]
pub(super) struct State {
    pub(super) memories: Memories,
    pub(super) races: Races,
    /// Dispatches so far.
    pub(super) dispatches: u64,
    /// True after a finding: nothing works any more.
    pub(super) is_lost: bool,
}

// SAFETY: clocks of a dispatch are shared within it only, and a dispatch runs while the state is locked.
unsafe impl Send for State {}

pub(super) unsafe extern "system" fn create(
    _: vk::PhysicalDevice,
    _: *const vk::DeviceCreateInfo<'_>,
    _: *const c_void,
    device: *mut vk::Device,
) -> vk::Result {
    let made = Box::into_raw(Box::new(Device {
        loader: LOADER_MAGIC,
        queues: [vk::Queue::null(); 2],
        state: Mutex::default(),
    }));
    unsafe {
        (*made).queues = [0, 1].map(|_| handle(Queue { loader: LOADER_MAGIC, device: made }));
        *device = vk::Handle::from_raw(made as u64);
    }
    vk::Result::SUCCESS
}

pub(super) unsafe extern "system" fn destroy(device: vk::Device, _: *const c_void) {
    if device != vk::Device::null() {
        unsafe {
            object::<Device>(device).queues.into_iter().for_each(|queue| drop_object::<Queue>(queue));
            drop_object::<Device>(device);
        }
    }
}

pub(super) unsafe extern "system" fn function(_: vk::Device, name: *const c_char) -> Option<Function> {
    super::function(unsafe { CStr::from_ptr(name) }.to_str().ok()?)
}

pub(super) unsafe extern "system" fn queue(device: vk::Device, family: u32, _: u32, to: *mut vk::Queue) {
    unsafe { *to = object::<Device>(device).queues[family as usize] };
}

pub(super) unsafe extern "system" fn queue2(
    device: vk::Device,
    info: *const vk::DeviceQueueInfo2<'_>,
    to: *mut vk::Queue,
) {
    unsafe { *to = object::<Device>(device).queues[(*info).queue_family_index as usize] };
}

pub(super) unsafe extern "system" fn wait_idle(device: vk::Device) -> vk::Result {
    unsafe { object::<Device>(device) }.result()
}

impl Device {
    pub(super) fn of<'a>(device: vk::Device) -> &'a Self {
        // SAFETY: see the head of the parent module.
        unsafe { object(device) }
    }

    /// Success, unless the device is lost.
    pub(super) fn result(&self) -> vk::Result {
        if lock(&self.state).is_lost { vk::Result::ERROR_DEVICE_LOST } else { vk::Result::SUCCESS }
    }
}
