//! Transfers between host and buffers, outside of lists.

use super::Scheduler;
use super::recorder::Recorder;
use super::storage::Storage;
use super::storage::copy_of;
use crate::error::{Error, Result};
use crate::gpu::{Buffer, Gpu, MemoryKind};
use crate::scheduler::plan::{Buf, Class, memory};
use bytemuck::Pod;
use std::sync::Arc;

/// Host-visible memory for transfers to and from device memory.
pub(super) struct Staging {
    up: Buffer,
    down: Buffer,
}

impl Staging {
    pub(super) fn new(gpu: &Arc<Gpu>) -> Result<Self> {
        let bytes = memory::STAGING_BYTES / 2;
        let up = Buffer::new(gpu, "staging up", bytes, MemoryKind::Upload)?;
        Ok(Self { up, down: Buffer::new(gpu, "staging down", bytes, MemoryKind::Download)? })
    }

    pub(super) fn bytes(&self) -> u64 {
        self.up.bytes() + self.down.bytes()
    }
}

impl Scheduler {
    /// Writes elements to a buffer, starting at element `first`; `T` may be any plain type.
    ///
    /// Waits for all uses of the buffer. `frame` matters for PerFrame and Report buffers only. A scratch buffer belongs
    /// to the list that was prepared or submitted last, whose plan must not alias.
    pub fn upload<T: Pod>(&mut self, buf: Buf, frame: usize, first: u64, data: &[T]) -> Result<()> {
        let data: &[u8] = bytemuck::cast_slice(data);
        let start = self.range(buf, frame, first, data.len() as u64)?;
        if data.is_empty() {
            return Ok(());
        }
        let class = self.decl(buf)?.class;
        self.traffic.up += data.len() as u64;
        if class.is_shared() {
            self.wait_frame(frame)?;
            return match self.loads.as_ref().filter(|_| class == Class::PerFrame) {
                Some(_) => self.stage(buf, frame, start, data),
                None => self.storage.own_buffer(buf, frame)?.write(start, data),
            };
        }
        if class == Class::Step && self.options.plan.aliases() {
            let name = self.decl(buf)?.name;
            return Err(Error::Bug(format!(
                "{name} is a scratch buffer with shared bytes; plan without aliasing to upload to it"
            )));
        }
        let half = self.staging.up.bytes();
        for (index, chunk) in data.chunks(half as usize).enumerate() {
            let at = start + index as u64 * half;
            self.staging.up.write(0, chunk)?;
            let place = self.locate(buf, frame)?;
            self.immediately(|recorder, storage, staging| {
                let (buffer, offset) = place.find(storage)?;
                recorder.copy((&staging.up, 0), (buffer, offset + at), chunk.len() as u64)
            })?;
        }
        Ok(())
    }

    /// Reads `count` values from a buffer, starting at element `first`; `T` may be any plain type.
    ///
    /// Waits for all writes to the buffer. `frame` matters for PerFrame and Report buffers only. A scratch buffer
    /// belongs to the list that was prepared or submitted last; fails if later passes of that list have reused its
    /// bytes.
    pub fn download<T: Pod>(&mut self, buf: Buf, frame: usize, first: u64, count: usize) -> Result<Vec<T>> {
        let mut values = vec![T::zeroed(); count];
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut values);
        let start = self.range(buf, frame, first, bytes.len() as u64)?;
        self.check_survives(buf)?;
        self.read_bytes(buf, frame, start, bytes)?;
        Ok(values)
    }

    /// Sets every word of all copies of a buffer; waits for all uses of it.
    pub fn fill(&mut self, buf: Buf, word: u32) -> Result<()> {
        self.wait_all()?;
        if self.decl(buf)?.class != Class::Step && self.is_empty(buf)? {
            return Ok(());
        }
        let bytes = self.bytes(buf)?;
        let copies = if self.decl(buf)?.class.is_shared() { self.limits.frames } else { 1 };
        for copy in 0..copies {
            let place = self.locate(buf, copy)?;
            self.immediately(|recorder: &mut Recorder<'_>, storage, _| {
                let (buffer, offset) = place.find(storage)?;
                recorder.fill(buffer, offset, bytes, word)
            })?;
        }
        Ok(())
    }

    /// Returns the bytes of all elements of a buffer.
    pub fn bytes(&self, buf: Buf) -> Result<u64> {
        memory::bytes_of(self.decl(buf)?, &self.counts)
    }

    /// Returns true if a buffer has no elements; it then has no memory of its own.
    pub(super) fn is_empty(&self, buf: Buf) -> Result<bool> {
        Ok(self.decl(buf)?.count(&self.counts)? == 0)
    }

    /// Returns true if the current list uses a scratch buffer.
    pub(super) fn is_placed(&self, buf: Buf) -> bool {
        self.current.is_some_and(|list| self.lists[list].plan.placements[buf.index()].is_some())
    }

    pub(super) fn was_submitted(&self, list: usize) -> bool {
        self.lists[list].recordings.iter().any(|recording| recording.busy > 0)
    }

    /// Reads a range of words that may lie past the end of a buffer.
    pub(super) fn read_words(&mut self, buf: Buf, frame: usize, start: u64, bytes: u64) -> Result<Vec<u32>> {
        let mut words = vec![0_u32; bytes as usize / 4];
        self.read_bytes(buf, frame, start, bytemuck::cast_slice_mut(&mut words))?;
        Ok(words)
    }

    fn read_bytes(&mut self, buf: Buf, frame: usize, start: u64, bytes: &mut [u8]) -> Result<()> {
        if bytes.is_empty() {
            return Ok(());
        }
        let class = self.decl(buf)?.class;
        self.traffic.down += bytes.len() as u64;
        if class == Class::Report || (class == Class::PerFrame && self.loads.is_none()) {
            self.wait_frame(frame)?;
            return self.storage.own_buffer(buf, frame)?.read(start, bytes);
        }
        let half = self.staging.down.bytes();
        for (index, chunk) in bytes.chunks_mut(half as usize).enumerate() {
            let at = start + index as u64 * half;
            let place = self.locate(buf, frame)?;
            self.immediately(|recorder, storage, staging| {
                let (buffer, offset) = place.find(storage)?;
                recorder.copy((buffer, offset + at), (&staging.down, 0), chunk.len() as u64)
            })?;
            self.staging.down.read(0, chunk)?;
        }
        Ok(())
    }

    /// Returns the byte offset of an element; fails if the range leaves the buffer.
    pub(super) fn range(&self, buf: Buf, frame: usize, first: u64, bytes: u64) -> Result<u64> {
        self.check_frame(frame)?;
        let (decl, all) = (self.decl(buf)?, self.bytes(buf)?);
        let start = first
            .checked_mul(u64::from(decl.element_bytes))
            .filter(|start| start.checked_add(bytes).is_some_and(|end| end <= all) && bytes.is_multiple_of(4));
        start.ok_or_else(|| {
            let name = decl.name;
            Error::Bug(format!(
                "{bytes} bytes from element {first} of {name} ({all} bytes) are not a range of words inside the buffer"
            ))
        })
    }

    /// Returns the current location of a buffer.
    fn locate(&self, buf: Buf, frame: usize) -> Result<BufferLocation> {
        let decl = self.decl(buf)?;
        if decl.class != Class::Step {
            return Ok(BufferLocation::Own(buf, copy_of(decl.class, frame)));
        }
        let none = || Error::Bug(format!("{} is a scratch buffer, and no prepared list uses it", decl.name));
        let list = self.current.ok_or_else(none)?;
        let place = self.lists[list].plan.placement(buf)?;
        match place.page {
            crate::scheduler::plan::Page::Step(page) => Ok(BufferLocation::Step(page as usize, place.offset)),
            crate::scheduler::plan::Page::Own(buf) => Ok(BufferLocation::Own(buf, 0)),
        }
    }

    fn check_survives(&self, buf: Buf) -> Result<()> {
        let Some(list) = self.current else { return Ok(()) };
        let plan = &self.lists[list].plan;
        match plan.overwritten_by(buf) {
            None => Ok(()),
            Some(other) => {
                let (name, other) = (self.decl(buf)?.name, self.decl(other)?.name);
                let list = &plan.list.name;
                Err(Error::Bug(format!(
                    "list {list} reuses the bytes of {name} for {other}; plan without aliasing to read it"
                )))
            }
        }
    }
}

/// A buffer's location, which does not borrow the scheduler while commands are recorded.
#[derive(Clone, Copy)]
enum BufferLocation {
    Own(Buf, usize),
    Step(usize, u64),
}

impl BufferLocation {
    fn find(self, storage: &Storage) -> Result<(&Buffer, u64)> {
        match self {
            Self::Own(buf, copy) => Ok((storage.own_buffer(buf, copy)?, 0)),
            Self::Step(page, offset) => {
                let buffer = storage.step_pages().get(page);
                Ok((buffer.ok_or_else(|| Error::Bug(format!("no scratch page {page}")))?, offset))
            }
        }
    }
}
