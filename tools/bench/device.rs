//! The device that is measured.

use labelgs::Result;
use labelgs::gpu::{Gpu, GpuOptions};
use std::sync::Arc;

/// The device that LABELGS_DEVICE names, or the best.
pub fn open() -> Result<Arc<Gpu>> {
    Gpu::new(&GpuOptions::from_env()?)
}
