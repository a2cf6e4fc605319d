//! One error type for the whole engine. A message names a setting by a [`Setting`], never by a flag.

mod setting;

pub use setting::name_settings;
pub use setting::{Setting, Verb};

use std::path::{Path, PathBuf};

/// The result of a fallible function.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// An error. Its one-line message names the subject, the number and the cure.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// An argument, setting or environment variable has an invalid value.
    #[error("{argument}: {problem}")]
    Usage {
        /// Name of the argument, setting or variable.
        argument: String,
        /// What is wrong and what is expected.
        problem: String,
    },
    /// A file has invalid content.
    #[error("{}: {place}{}{problem}", path.display(), if place.is_empty() { "" } else { ": " })]
    Data {
        /// The file.
        path: PathBuf,
        /// Place in the file: a byte offset, a line, a record or a property. May be empty.
        place: String,
        /// What is wrong, what is expected and what to do.
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
    /// No Vulkan loader, driver or device meets the requirements.
    #[error("no usable Vulkan device: {0}")]
    NoDevice(String),
    /// A Vulkan call failed.
    #[error("{call} failed: {result}")]
    Vulkan {
        /// The call.
        call: &'static str,
        /// Its result.
        result: ash::vk::Result,
    },
    /// The device was lost.
    #[error("the device was lost; the last pass known to have started is {pass}")]
    DeviceLost {
        /// Name of the last pass that is known to have started, or `unknown`.
        pass: String,
    },
    /// A buffer exceeds a limit of the device or its memory.
    #[error("{what} needs {needed} bytes, {limit_name} is {limit} bytes; {cure}")]
    OutOfMemory {
        /// The buffer or page.
        what: String,
        /// Requested size in bytes.
        needed: u64,
        /// Name of the exceeded limit.
        limit_name: String,
        /// The limit in bytes.
        limit: u64,
        /// What the user can do.
        cure: String,
    },
    /// A loss or a parameter became infinite or NaN.
    #[error(
        "numerical failure at step {step}, view {view}: {quantity}; files saved before this step are intact. Check the \
         device with the self-test, then go on from the last checkpoint or with smaller learning rates"
    )]
    Numeric {
        /// The quantity that is infinite or NaN.
        quantity: String,
        /// The step.
        step: u64,
        /// The view.
        view: String,
    },
    /// Densification pruned every Gaussian.
    #[error("every Gaussian was pruned after step {step}: the poses do not fit the photos; check the capture first")]
    Pruned {
        /// The step.
        step: u32,
    },
    /// The work finished, and a requested check failed.
    #[error("check failed: {0}")]
    Check(String),
    /// The user interrupted the work.
    #[error("interrupted")]
    Interrupted,
    /// A broken invariant of the program itself.
    #[error("this is a bug in labelgs, please report it: {0}")]
    Bug(String),
}

impl Error {
    /// Returns true if memory of the device or the host ran out.
    pub fn is_out_of_memory(&self) -> bool {
        use ash::vk::Result as Vk;
        match self {
            Self::OutOfMemory { .. } => true,
            Self::Vulkan { result, .. } => matches!(
                *result,
                Vk::ERROR_OUT_OF_DEVICE_MEMORY
                    | Vk::ERROR_OUT_OF_HOST_MEMORY
                    | Vk::ERROR_OUT_OF_POOL_MEMORY
                    | Vk::ERROR_FRAGMENTED_POOL
                    | Vk::ERROR_TOO_MANY_OBJECTS
            ),
            _ => false,
        }
    }

    /// Returns true if the device was lost.
    pub fn is_device_lost(&self) -> bool {
        matches!(self, Self::DeviceLost { .. } | Self::Vulkan { result: ash::vk::Result::ERROR_DEVICE_LOST, .. })
    }

    /// Returns true if no device is usable, or its driver fails to start.
    pub fn is_without_device(&self) -> bool {
        use ash::vk::Result as Vk;
        match self {
            Self::NoDevice(_) => true,
            Self::Vulkan { result, .. } => matches!(
                *result,
                Vk::ERROR_INITIALIZATION_FAILED
                    | Vk::ERROR_INCOMPATIBLE_DRIVER
                    | Vk::ERROR_LAYER_NOT_PRESENT
                    | Vk::ERROR_EXTENSION_NOT_PRESENT
                    | Vk::ERROR_FEATURE_NOT_PRESENT
                    | Vk::ERROR_UNKNOWN
            ),
            _ => false,
        }
    }

    /// Returns an [`Error::Data`].
    pub fn data(path: impl AsRef<Path>, place: impl Into<String>, problem: impl Into<String>) -> Self {
        Self::Data { path: path.as_ref().to_owned(), place: place.into(), problem: problem.into() }
    }

    /// Returns an [`Error::Usage`]. `argument` is a [`Setting`] or the name of something else.
    pub fn usage(argument: impl Into<String>, problem: impl Into<String>) -> Self {
        Self::Usage { argument: argument.into(), problem: problem.into() }
    }

    /// Returns a closure for `map_err` that creates an [`Error::Read`].
    pub fn read(path: impl AsRef<Path>) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.as_ref().to_owned();
        move |source| Self::Read { path, source }
    }

    /// Returns a closure for `map_err` that creates an [`Error::Write`].
    pub fn write(path: impl AsRef<Path>) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.as_ref().to_owned();
        move |source| Self::Write { path, source }
    }
}
