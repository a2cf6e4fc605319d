//! Memory of a plan: a VkBuffer or sub-range (`packed`) for each buffer outside of scratch, and the pages of the Step
//! arena.

use super::{Scheduler, guard};
use crate::error::{Error, Result};
use crate::gpu::{Buffer, Gpu, MemoryKind};
use crate::scheduler::plan::{Buf, BufferDecl, Class, Limits, Page, Plan, Table, memory};
use std::sync::Arc;

/// All buffers of a scheduler.
pub(super) struct Storage {
    /// By row of the table, then by copy; empty for scratch.
    pub(super) own: Vec<Vec<Buffer>>,
    /// Pages of the Step arena.
    step: Vec<Buffer>,
}

impl Storage {
    pub(super) fn new(rows: usize) -> Self {
        Self { own: (0..rows).map(|_| Vec::new()).collect(), step: Vec::new() }
    }

    /// Returns the memory and byte offset of a plan's buffer in a frame.
    pub(super) fn place(&self, plan: &Plan, buf: Buf, frame: usize) -> Result<(&Buffer, u64)> {
        let place = plan.placement(buf)?;
        let buffer = match place.page {
            Page::Step(page) => self.step.get(page as usize),
            Page::Own(buf) => {
                return Ok((self.own_buffer(buf, copy_of(plan.table[buf.index()].class, frame))?, place.offset));
            }
        };
        Ok((buffer.ok_or_else(|| Error::Bug(format!("no memory for buffer {}", buf.0)))?, place.offset))
    }

    /// Returns one copy of a buffer outside of scratch.
    pub(super) fn own_buffer(&self, buf: Buf, copy: usize) -> Result<&Buffer> {
        let buffer = self.own.get(buf.index()).and_then(|copies| copies.get(copy));
        buffer.ok_or_else(|| Error::Bug(format!("no memory for copy {copy} of buffer {}", buf.0)))
    }

    /// Pages of the Step arena.
    pub(super) fn step_pages(&self) -> &[Buffer] {
        &self.step
    }

    pub(super) fn drop_arena(&mut self) {
        self.step.clear();
    }

    /// Allocated bytes of each buffer and page.
    pub(super) fn memory(&self, table: &'static Table) -> Vec<(String, u64)> {
        let own = table.iter().zip(&self.own).filter(|(_, copies)| !copies.is_empty());
        let own = own.map(|(decl, copies)| (decl.name.to_owned(), copies.iter().map(Buffer::bytes).sum()));
        let step = self.step.iter().enumerate().map(|(page, buffer)| (format!("scratch page {page}"), buffer.bytes()));
        own.chain(step).collect()
    }
}

/// Allocates all copies of a buffer; returns none for a buffer of 0 bytes.
fn allocate(gpu: &Arc<Gpu>, decl: &BufferDecl, bytes: u64, limits: &Limits) -> Result<Vec<Buffer>> {
    let kind = |copy| memory::kind(decl.class, copy, limits);
    let copies = if bytes == 0 { 0 } else { decl.class.copies(limits) };
    (0..copies).map(|copy| Buffer::new(gpu, decl.name, bytes, kind(copy))).collect()
}

impl Scheduler {
    /// Bytes of the VkBuffer of one copy of a buffer.
    fn own_bytes(&self, decl: &BufferDecl, counts: &[u64]) -> Result<u64> {
        memory::own_bytes(decl, counts, self.options.plan, self.limits.alignment())
    }

    /// Allocates every buffer outside of scratch.
    pub(super) fn allocate_own(&mut self) -> Result<()> {
        if self.limits.is_packed() {
            self.storage.own = self.packed(&self.counts)?;
            (0..self.table.len()).try_for_each(|index| self.clear(Buf(index as u16)))?;
            return self.write_own_guards();
        }
        for index in 0..self.table.len() {
            let decl = &self.table[index];
            if decl.class != Class::Step {
                self.storage.own[index] = allocate(&self.gpu, decl, self.own_bytes(decl, &self.counts)?, &self.limits)?;
                self.clear(Buf(index as u16))?;
            }
        }
        self.write_own_guards()
    }

    /// Reallocates every buffer whose size changes. Model buffers keep the common prefix, all others are reset.
    ///
    /// Buffers grow first. If one does not fit, those that have grown are merely larger than the old counts need, and
    /// nothing is lost.
    pub(super) fn resize_own(&mut self, counts: Vec<u64>) -> Result<()> {
        self.cancel_loads();
        let is_packed = self.limits.is_packed();
        let resized = match is_packed {
            true => self.resize_packed(&counts),
            false => self.resize_those(&counts, true).and_then(|()| self.resize_those(&counts, false)),
        };
        if resized.is_ok() {
            self.counts = counts;
        } else if !is_packed {
            // Shrink the grown buffers again, because others need that memory; a buffer that fails to shrink stays
            // large.
            let old = self.counts.clone();
            if let Err(error) = self.resize_those(&old, false) {
                tracing::debug!("some buffers stay large: {error}");
            }
        }
        for index in 0..self.table.len() {
            if matches!(self.table[index].class, Class::Persistent | Class::PerFrame | Class::Report) {
                self.clear(Buf(index as u16))?;
            }
        }
        self.write_own_guards()?;
        resized
    }

    /// Allocates the buffers that a failed [`Self::resize_own`] lost: their old memory was freed for the new one, and
    /// could not be allocated again. They have no contents to keep.
    pub(super) fn replace_lost(&mut self) -> Result<()> {
        for index in 0..self.table.len() {
            if self.grows(index, &self.counts)? == Some(true) {
                return self.resize_own(self.counts.clone());
            }
        }
        Ok(())
    }

    fn resize_those(&mut self, counts: &[u64], grow: bool) -> Result<()> {
        for index in 0..self.table.len() {
            if self.grows(index, counts)? == Some(grow) {
                self.resize(index, counts)?;
            }
        }
        Ok(())
    }

    /// Returns true if a buffer must grow, false if it may shrink, `None` if it stays.
    pub(super) fn grows(&self, index: usize, counts: &[u64]) -> Result<Option<bool>> {
        let decl = &self.table[index];
        if decl.class == Class::Step {
            return Ok(None);
        }
        let now = self.storage.own[index].first().map_or(0, Buffer::bytes);
        let wanted = self.own_bytes(decl, counts)?;
        Ok((wanted != now).then_some(wanted > now))
    }

    fn resize(&mut self, index: usize, counts: &[u64]) -> Result<()> {
        let (decl, buf) = (&self.table[index], Buf(index as u16));
        let keep = memory::bytes_of(decl, counts)?.min(memory::bytes_of(decl, &self.counts)?);
        let bytes = self.own_bytes(decl, counts)?;
        if decl.class != Class::Model {
            // There are no contents to keep, so the old memory is freed before the new is allocated.
            let old = std::mem::take(&mut self.storage.own[index]);
            let old_bytes = old.first().map_or(0, Buffer::bytes);
            drop(old);
            return match allocate(&self.gpu, decl, bytes, &self.limits) {
                Ok(copies) => {
                    self.storage.own[index] = copies;
                    Ok(())
                }
                Err(error) => {
                    // The old size fitted a moment ago. If it fails now, report the first error; the next list retries.
                    self.storage.own[index] = allocate(&self.gpu, decl, old_bytes, &self.limits).unwrap_or_default();
                    Err(error)
                }
            };
        }
        let fresh = allocate(&self.gpu, decl, bytes, &self.limits)?;
        let old = std::mem::replace(&mut self.storage.own[index], fresh);
        if bytes == 0 {
            return Ok(());
        }
        self.immediately(|recorder, storage, _| {
            let fresh = storage.own_buffer(buf, 0)?;
            let Some(old) = old.first() else { return recorder.fill(fresh, 0, bytes, 0) };
            if bytes > keep {
                recorder.fill(fresh, keep, bytes - keep, 0)?;
            }
            recorder.copy((old, 0), (fresh, 0), keep)
        })
    }

    /// Zeroes all copies of a buffer outside of scratch.
    fn clear(&mut self, buf: Buf) -> Result<()> {
        self.immediately(|recorder, storage, _| {
            for buffer in &storage.own[buf.index()] {
                recorder.fill(buffer, 0, buffer.bytes(), 0)?;
            }
            Ok(())
        })
    }

    /// Grows the Step arena to at least these page sizes. If it has to grow, all existing lists are recorded again.
    pub(super) fn grow_arena(&mut self, pages: &[u64]) -> Result<()> {
        let now = self.storage.step.iter().map(Buffer::bytes).collect::<Vec<_>>();
        let merged = memory::merge_pages([now.as_slice(), pages].into_iter());
        if merged == now {
            return Ok(());
        }
        self.wait_all()?;
        let current = self.current.take();
        let plans = std::mem::take(&mut self.lists).into_iter().map(|list| list.plan).collect::<Vec<_>>();
        // Scratch has no contents to keep, so the old memory is freed before the new is allocated. If allocation fails,
        // all lists are discarded, so that none can use the missing memory.
        self.storage.step.clear();
        let generation = self.generation;
        self.generation += 1;
        for (page, bytes) in merged.iter().enumerate() {
            let name = format!("scratch page {page}");
            let page = match Buffer::new(&self.gpu, &name, *bytes, MemoryKind::Device) {
                Err(error) if error.is_out_of_memory() && self.free_more()? => {
                    Buffer::new(&self.gpu, &name, *bytes, MemoryKind::Device)?
                }
                other => other?,
            };
            self.storage.step.push(page);
        }
        for plan in plans {
            let recordings = self.record(&plan)?;
            self.lists.push(super::List { plan, recordings });
        }
        (self.generation, self.current) = (generation, current);
        Ok(())
    }

    /// Fills the Step arena with NaN.
    pub(super) fn poison(&mut self) -> Result<()> {
        self.immediately(|recorder, storage, _| {
            storage.step.iter().try_for_each(|page| recorder.fill(page, 0, page.bytes(), u32::MAX))
        })
    }

    /// Writes the guards after the buffers outside of scratch.
    fn write_own_guards(&mut self) -> Result<()> {
        if !self.options.plan.guards {
            return Ok(());
        }
        let (table, counts) = (self.table, self.counts.clone());
        self.immediately(|recorder, storage, _| {
            for (decl, copies) in table.iter().zip(&storage.own) {
                let bytes = memory::bytes_of(decl, &counts)?;
                copies.iter().try_for_each(|buffer| guard::write(recorder, buffer, bytes))?;
            }
            Ok(())
        })
    }
}

/// Returns the index of a buffer's copy for a frame.
pub(super) fn copy_of(class: Class, frame: usize) -> usize {
    if class.is_shared() { frame } else { 0 }
}
