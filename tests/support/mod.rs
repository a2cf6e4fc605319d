//! What the tests share: a device, comparison predicates, small scenes, toy shaders.

pub mod compare;
pub mod device;
pub mod runs;
pub mod toy;

pub use device::device;
pub use labelgs::selftest::scenes;
