//! Helpers of the tests: a device, counted memory, comparison predicates, small scenes, a tiny segmenter, toy
//! shaders.

pub mod compare;
pub mod device;
pub mod memory;
pub mod mutants;
pub mod runs;
pub mod segmenter;
pub mod toy;

pub use device::device;
pub use labelgs::verify::selftest::scenes;
