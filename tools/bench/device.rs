//! The device that is measured.

use labelgs::gpu::{Gpu, GpuOptions, MessageLog};
use labelgs::{Error, Result};
use std::sync::{Arc, Mutex, PoisonError};

/// Messages of the validation layer for each device; outlives the device.
static LOGS: Mutex<Vec<MessageLog>> = Mutex::new(Vec::new());

/// The device that LABELGS_DEVICE names, or the best.
pub fn open() -> Result<Arc<Gpu>> {
    let gpu = Gpu::new(&GpuOptions::from_env()?)?;
    LOGS.lock().unwrap_or_else(PoisonError::into_inner).push(gpu.message_log());
    Ok(gpu)
}

/// Fails if the validation layer reported anything before the devices were destroyed.
pub fn require_silence() -> Result<()> {
    let logs = LOGS.lock().unwrap_or_else(PoisonError::into_inner);
    let messages: Vec<_> = logs.iter().flat_map(MessageLog::messages).collect();
    match messages.first() {
        None => Ok(()),
        Some(first) => Err(Error::Check(format!("{} messages of the validation layer: {first:#?}", messages.len()))),
    }
}
