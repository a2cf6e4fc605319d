//! The one way to call a Vulkan function that may fail.

use crate::error::{Error, Result};
use ash::vk;

/// Calls Vulkan and names the call in the error.
///
/// With the environment variable `LABELGS_FAULT=vkName:n:RESULT` the n-th call of that name fails without being made, so
/// that every failure can be tested.
pub(crate) fn vk_call<T>(call: &'static str, function: impl FnOnce() -> ash::prelude::VkResult<T>) -> Result<T> {
    let outcome = match fault(call) {
        Some(result) => Err(result),
        None => function(),
    };
    outcome.map_err(|result| error(call, result))
}

/// The fault that this call meets, if one was asked for.
pub(super) fn fault(call: &str) -> Option<vk::Result> {
    fault::of(call)
}

/// The error of a failed call.
fn error(call: &'static str, result: vk::Result) -> Error {
    match result {
        vk::Result::ERROR_DEVICE_LOST => Error::DeviceLost { pass: "unknown".to_owned() },
        _ => Error::Vulkan { call, result },
    }
}

/// Faults that tests ask for.
mod fault {
    use ash::vk;
    use std::sync::OnceLock;
    use std::sync::atomic::{AtomicU64, Ordering};

    struct Fault {
        call: String,
        after: AtomicU64,
        result: vk::Result,
    }

    /// The fault that this call meets: `LABELGS_FAULT=vkQueueSubmit:3:DEVICE_LOST` fails the third submit, as do
    /// `HOST_MEMORY` and `DEVICE_MEMORY` with a lack of memory.
    pub(super) fn of(call: &str) -> Option<vk::Result> {
        static FAULT: OnceLock<Option<Fault>> = OnceLock::new();
        let fault = FAULT.get_or_init(|| parse(&std::env::var("LABELGS_FAULT").ok()?)).as_ref()?;
        let hit = fault.call == call && fault.after.fetch_sub(1, Ordering::Relaxed) == 1;
        hit.then_some(fault.result)
    }

    fn parse(text: &str) -> Option<Fault> {
        let mut parts = text.split(':');
        let (call, after, result) = (parts.next()?, parts.next()?.parse().ok()?, parts.next()?);
        let result = match result {
            "DEVICE_LOST" => vk::Result::ERROR_DEVICE_LOST,
            "HOST_MEMORY" => vk::Result::ERROR_OUT_OF_HOST_MEMORY,
            "DEVICE_MEMORY" => vk::Result::ERROR_OUT_OF_DEVICE_MEMORY,
            _ => return None,
        };
        Some(Fault { call: call.to_owned(), after: AtomicU64::new(after), result })
    }
}
