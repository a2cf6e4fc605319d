//! What tests share.

pub mod device;
pub mod toy;

pub use device::device;
