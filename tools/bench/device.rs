//! The measured device.

use labelgs::gpu::{Gpu, GpuOptions, MessageLog};
use labelgs::{Error, Result};
use std::sync::{Arc, Mutex, PoisonError};

/// Messages of the validation layer per device; they outlive the device.
static LOGS: Mutex<Vec<MessageLog>> = Mutex::new(Vec::new());

/// Opens the device named by LABELGS_DEVICE, or the best one.
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
