//! Guards for tests: a known pattern after each buffer, which no pass may overwrite.

use super::Scheduler;
use super::recorder::Recorder;
use crate::error::{Error, Result};
use crate::gpu::Buffer;
use crate::scheduler::plan::{Buf, Class, GUARD_BYTES};

const GUARD_PATTERN: u32 = 0x5AFE_C0DE;

/// Writes the guard that starts at a byte offset.
pub(super) fn write(recorder: &Recorder<'_>, buffer: &Buffer, offset: u64) -> Result<()> {
    recorder.fill(buffer, offset, GUARD_BYTES, GUARD_PATTERN)
}

impl Scheduler {
    /// Fails if a pass wrote past the end of a buffer; the error names the buffer and the first wrong word.
    ///
    /// Checks all buffers outside of scratch, and the scratch of the list that was prepared or submitted last.
    pub fn check_guards(&mut self) -> Result<()> {
        if !self.options.plan.guards {
            return Err(Error::Bug("the scheduler has no guards; set PlanOptions::guards".to_owned()));
        }
        self.wait_all()?;
        for index in 0..self.table.len() {
            let (decl, buf) = (&self.table[index], Buf(index as u16));
            if decl.class != Class::Step && self.is_empty(buf)? {
                continue;
            }
            let submitted = self.current.is_some_and(|list| self.was_submitted(list));
            if decl.class == Class::Step && !(submitted && self.is_placed(buf)) {
                continue;
            }
            let copies = if decl.class.is_shared() { self.limits.frames } else { 1 };
            for frame in 0..copies {
                let end = self.bytes(buf)?;
                let words = self.read_words(buf, frame, end, GUARD_BYTES)?;
                if let Some(position) = words.iter().position(|&word| word != GUARD_PATTERN) {
                    let (name, value) = (decl.name, words[position]);
                    return Err(Error::Bug(format!(
                        "a pass wrote {value:#010x} at byte {} past the end of buffer {name} ({end} bytes)",
                        position * 4
                    )));
                }
            }
        }
        Ok(())
    }
}
