//! A Vulkan driver for tests.
#![allow(unsafe_code)]

pub mod findings;
pub mod driver;
mod lane;
pub mod lower;
pub mod machine;
pub mod memory;
pub mod ops;
pub mod program;
pub mod races;
mod shared;
