//! Calls Vulkan functions that may fail; all such calls go through here.

use crate::error::{Error, Result};
use crate::lab::fault::{self, Kind};
use ash::vk;

/// Calls Vulkan and names the call in the error.
///
/// With an injected [fault](fault), the function returns its error without calling Vulkan.
pub(crate) fn vk_call<T>(call: &'static str, function: impl FnOnce() -> ash::prelude::VkResult<T>) -> Result<T> {
    let outcome = match fault(call) {
        Some(result) => Err(result),
        None => function(),
    };
    outcome.map_err(|result| error(call, result))
}

/// The injected fault for this call, if any.
pub(super) fn fault(call: &str) -> Option<vk::Result> {
    let kind = match fault::injected(call) {
        None => fault::injected("vulkan"),
        found => found,
    };
    kind.map(|kind| match kind {
        Kind::DeviceLost => vk::Result::ERROR_DEVICE_LOST,
        Kind::HostMemory => vk::Result::ERROR_OUT_OF_HOST_MEMORY,
        Kind::DeviceMemory => vk::Result::ERROR_OUT_OF_DEVICE_MEMORY,
        _ => vk::Result::ERROR_INITIALIZATION_FAILED,
    })
}

/// The error of a failed call.
fn error(call: &'static str, result: vk::Result) -> Error {
    match result {
        vk::Result::ERROR_DEVICE_LOST => Error::DeviceLost { pass: "unknown".to_owned() },
        _ => Error::Vulkan { call, result },
    }
}
