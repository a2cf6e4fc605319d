//! Helpers of the tests: a device, counted memory, comparison predicates, small scenes, toy shaders.

pub mod compare;
pub mod device;
pub mod memory;
pub mod mutants;
pub mod runs;
pub mod toy;

pub use device::device;
pub use labelgs::verify::selftest::scenes;
