//! One error type for the whole engine, and the exit status that each kind of error becomes.

use std::path::{Path, PathBuf};

/// What every fallible function of the crate returns.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Everything that can go wrong. A message names the thing, the number and the cure in one line.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The command line or a configuration asks for something that makes no sense.
    #[error("{argument}: {problem}")]
    Usage {
        /// Flag, field or argument.
        argument: String,
        /// What is wrong with it and what was expected.
        problem: String,
    },
    /// A file holds something that cannot be used.
    #[error("{}: {place}{}{problem}", path.display(), if place.is_empty() { "" } else { ": " })]
    Data {
        /// The file.
        path: PathBuf,
        /// Where in the file: a byte offset, a line, a record, a property. May be empty.
        place: String,
        /// What is wrong, what was expected and what to do.
        problem: String,
    },
    /// A file could not be read.
    #[error("{}: cannot be read: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The cause.
        source: std::io::Error,
    },
    /// A file could not be written.
    #[error("{}: cannot be written: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The cause.
        source: std::io::Error,
    },
    /// No Vulkan loader, driver or device that fits.
    #[error("no usable Vulkan device: {0}")]
    NoDevice(String),
    /// A Vulkan call failed.
    #[error("{call} failed: {result}")]
    Vulkan {
        /// The call.
        call: &'static str,
        /// What it returned.
        result: ash::vk::Result,
    },
    /// The device was lost.
    #[error("the device was lost; the last pass known to have started is {pass}")]
    DeviceLost {
        /// Name of the pass, or `unknown`.
        pass: String,
    },
    /// A buffer does not fit the device, or its memory.
    #[error("{what} needs {needed} bytes, {limit_name} is {limit} bytes; {cure}")]
    OutOfMemory {
        /// The buffer or page.
        what: String,
        /// Bytes asked for.
        needed: u64,
        /// Name of the limit that was met.
        limit_name: String,
        /// The limit in bytes.
        limit: u64,
        /// What the user can do.
        cure: String,
    },
    /// A loss or a parameter became infinite or not a number.
    #[error(
        "numerical failure at step {step}, view {view}: {quantity}; what was saved before is whole: see `labelgs \
         selftest`, and go on with `train --resume`, or with smaller learning rates"
    )]
    Numeric {
        /// The quantity that is not finite.
        quantity: String,
        /// The step.
        step: u64,
        /// The view.
        view: String,
    },
    /// Densification has left nothing to train.
    #[error(
        "every Gaussian was pruned after step {step}: the poses or the photos do not fit together, or --min-opacity or \
         --max-scale take too much"
    )]
    Pruned {
        /// The step.
        step: u32,
    },
    /// The run finished, and a check that was asked for failed.
    #[error("check failed: {0}")]
    Check(String),
    /// The user interrupted the run; holds the exit status (130 or 143).
    #[error("interrupted")]
    Interrupted(i32),
    /// A broken invariant of the program itself.
    #[error("this is a bug in labelgs, please report it: {0}")]
    Bug(String),
}

impl Error {
    /// True if memory of the device or of the host ran out.
    pub fn is_out_of_memory(&self) -> bool {
        self.exit_status() == 5
    }

    /// True if there is no device to work with, or its driver does not start.
    pub fn is_without_device(&self) -> bool {
        self.exit_status() == 4
    }

    /// A [`Error::Data`] without much ado.
    pub fn data(path: impl AsRef<Path>, place: impl Into<String>, problem: impl Into<String>) -> Self {
        Self::Data { path: path.as_ref().to_owned(), place: place.into(), problem: problem.into() }
    }

    /// A [`Error::Usage`] without much ado.
    pub fn usage(argument: impl Into<String>, problem: impl Into<String>) -> Self {
        Self::Usage { argument: argument.into(), problem: problem.into() }
    }

    /// A [`Error::Read`] as a closure for `map_err`.
    pub fn read(path: impl AsRef<Path>) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.as_ref().to_owned();
        move |source| Self::Read { path, source }
    }

    /// A [`Error::Write`] as a closure for `map_err`.
    pub fn write(path: impl AsRef<Path>) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.as_ref().to_owned();
        move |source| Self::Write { path, source }
    }

    /// Exit status of the process that ends with this error.
    pub fn exit_status(&self) -> i32 {
        match self {
            Self::Check(_) => 1,
            Self::Usage { .. } => 2,
            Self::Data { .. } | Self::Read { .. } | Self::Pruned { .. } => 3,
            Self::NoDevice(_) => 4,
            Self::OutOfMemory { .. } => 5,
            Self::DeviceLost { .. } => 6,
            Self::Write { .. } => 7,
            Self::Numeric { .. } => 8,
            Self::Interrupted(status) => *status,
            Self::Vulkan { result, .. } => match *result {
                ash::vk::Result::ERROR_OUT_OF_DEVICE_MEMORY
                | ash::vk::Result::ERROR_OUT_OF_HOST_MEMORY
                | ash::vk::Result::ERROR_OUT_OF_POOL_MEMORY
                | ash::vk::Result::ERROR_FRAGMENTED_POOL
                | ash::vk::Result::ERROR_TOO_MANY_OBJECTS => 5,
                ash::vk::Result::ERROR_DEVICE_LOST => 6,
                ash::vk::Result::ERROR_INITIALIZATION_FAILED
                | ash::vk::Result::ERROR_INCOMPATIBLE_DRIVER
                | ash::vk::Result::ERROR_LAYER_NOT_PRESENT
                | ash::vk::Result::ERROR_EXTENSION_NOT_PRESENT
                | ash::vk::Result::ERROR_FEATURE_NOT_PRESENT
                | ash::vk::Result::ERROR_UNKNOWN => 4,
                _ => 70,
            },
            Self::Bug(_) => 70,
        }
    }
}
