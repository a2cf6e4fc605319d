//! Helpers of the tests: the device, toy shaders, predicates and scenes.

pub mod compare;
pub mod device;
pub mod scenes;
pub mod toy;

pub use device::device;
