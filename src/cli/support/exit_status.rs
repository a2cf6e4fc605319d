//! Exit statuses: 0 for success, otherwise the kind of the error.

use crate::Error;
use crate::cli::support::signals;

/// Status of a bug in the program.
pub(crate) const BUG_STATUS: i32 = 70;

/// Returns the exit status of a process that ends with `error`.
pub fn exit_status(error: &Error) -> i32 {
    match error {
        Error::Check(_) => 1,
        Error::Usage { .. } => 2,
        Error::Data { .. } | Error::Read { .. } | Error::Pruned { .. } => 3,
        Error::NoDevice(_) => 4,
        Error::OutOfMemory { .. } => 5,
        Error::DeviceLost { .. } => 6,
        Error::Write { .. } => 7,
        Error::Numeric { .. } => 8,
        Error::Interrupted => signals::status(),
        Error::Vulkan { .. } if error.is_without_device() => 4,
        Error::Vulkan { .. } if error.is_out_of_memory() => 5,
        Error::Vulkan { .. } if error.is_device_lost() => 6,
        Error::Vulkan { .. } | Error::Bug(_) => BUG_STATUS,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ash::vk::Result as Vk;

    #[test]
    fn every_error_has_its_status() {
        let io = || std::io::Error::from(std::io::ErrorKind::NotFound);
        let vulkan = |result| Error::Vulkan { call: "vkCall", result };
        let memory = Error::OutOfMemory {
            what: "page".into(),
            needed: 2,
            limit_name: "heap".into(),
            limit: 1,
            cure: "none".into(),
        };
        let expected = [
            (Error::Check("PSNR".into()), 1),
            (Error::usage("views", "is 0"), 2),
            (Error::data("a.ply", "", "is empty"), 3),
            (Error::read("a.ply")(io()), 3),
            (Error::Pruned { step: 1 }, 3),
            (Error::NoDevice("none".into()), 4),
            (vulkan(Vk::ERROR_INCOMPATIBLE_DRIVER), 4),
            (memory, 5),
            (vulkan(Vk::ERROR_OUT_OF_DEVICE_MEMORY), 5),
            (Error::DeviceLost { pass: "scan".into() }, 6),
            (vulkan(Vk::ERROR_DEVICE_LOST), 6),
            (Error::write("a.ply")(io()), 7),
            (Error::Numeric { quantity: "loss".into(), step: 1, view: "a".into() }, 8),
            (vulkan(Vk::ERROR_FORMAT_NOT_SUPPORTED), 70),
            (Error::Bug("x".into()), 70),
            (Error::Interrupted, 130),
        ];
        for (error, status) in expected {
            assert_eq!(exit_status(&error), status, "{error}");
        }
    }
}
