//! Crash markers in host-visible memory, which identify the last pass when the device is lost.

use super::Gpu;
use super::memory::{Buffer, MemoryKind};
use crate::error::Result;
use std::sync::Arc;

/// One word per item of a recording: 0, or 1 once the device has begun it.
pub(crate) struct Markers {
    buffer: Buffer,
    items: usize,
}

impl Markers {
    pub(crate) fn new(gpu: &Arc<Gpu>, items: usize) -> Result<Self> {
        let bytes = (items.max(1) * 4) as u64;
        let buffer = Buffer::new(gpu, "crash markers", bytes, MemoryKind::Download)?;
        let markers = Self { buffer, items };
        markers.reset()?;
        Ok(markers)
    }

    /// Clears the markers; the recording must not be running.
    pub(crate) fn reset(&self) -> Result<()> {
        self.buffer.write(0, &vec![0; self.buffer.bytes() as usize])
    }

    pub(crate) fn buffer(&self) -> &Buffer {
        &self.buffer
    }

    /// The last item that the device is known to have begun.
    pub(crate) fn last_begun(&self) -> Option<usize> {
        let mut bytes = vec![0; self.items * 4];
        self.buffer.read(0, &mut bytes).ok()?;
        bytes.chunks_exact(4).rposition(|word| word != [0; 4])
    }
}
