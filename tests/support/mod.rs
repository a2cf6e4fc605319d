//! What the tests share: a device, comparison predicates, small scenes, toy shaders.

pub mod compare;
pub mod device;
pub mod scenes;
pub mod toy;

pub use device::device;
