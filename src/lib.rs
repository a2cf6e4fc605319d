//! labelgs: label-aware 3D Gaussian Splatting on Vulkan compute.
#![deny(unsafe_code)]

pub mod cli;
pub mod engine;
pub mod error;
pub mod gpu;
pub mod infer;
pub mod io;
pub mod pass;
pub mod plan;
pub mod scene;
pub mod sched;
pub mod shaders;
pub mod synth;
pub mod train;

pub use error::{Error, Result};
