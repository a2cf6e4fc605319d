//! Memory and bindings for devices on which all buffers share few storage bindings, see [`windows`].

use super::Scheduler;
use super::storage::Storage;
use crate::error::Result;
use crate::gpu::{Buffer, Gpu, stride};
use crate::scheduler::plan::windows::{self, Cover, Layout, Span};
use crate::scheduler::plan::{Buf, Class, PassDecl, Plan, memory};
use crate::shaders::BindingKind;
use ash::vk::Handle;
use std::sync::Arc;

/// Windows of a pass.
pub(super) struct PassWindows<'a> {
    pub(super) cover: Cover<u64>,
    /// One buffer per window, for its handle.
    pub(super) buffers: Vec<&'a Buffer>,
    /// Offset of each buffer in its window, in elements.
    pub(super) places: Vec<u32>,
}

/// Assigns windows to the storage buffers of a pass.
pub(super) fn bound<'a>(
    gpu: &Gpu,
    storage: &'a Storage,
    plan: &Plan,
    pass: &PassDecl,
    frame: usize,
) -> Result<PassWindows<'a>> {
    let own = || pass.shader.bindings.iter().zip(&pass.buffers).filter(|(desc, _)| desc.kind == BindingKind::Storage);
    let (mut spans, mut all) = (Vec::new(), Vec::new());
    for (_, &buf) in own() {
        let (buffer, offset) = storage.place(plan, buf, frame)?;
        let start = buffer.start() + offset;
        spans.push(Span { of: buffer.raw().as_raw(), start, end: start + plan.placement(buf)?.bound });
        all.push(buffer);
    }
    let cover = windows::cover(&spans, &gpu.limits().plan);
    let windows = cover.window_of.iter().map(|&window| cover.windows[usize::from(window)]);
    let starts = spans.iter().zip(windows).map(|(span, window)| span.start - window.start);
    let places = starts.zip(own()).map(|(bytes, (desc, _))| (bytes / stride(desc)) as u32).collect();
    let first = |window: usize| cover.window_of.iter().position(|&of| usize::from(of) == window);
    let buffers = (0..cover.windows.len()).filter_map(|window| first(window).map(|index| all[index])).collect();
    Ok(PassWindows { cover, buffers, places })
}

impl Scheduler {
    /// Allocates every buffer outside of scratch as a sub-range of a few blocks.
    pub(super) fn packed(&self, counts: &[u64]) -> Result<Vec<Vec<Buffer>>> {
        let layout = Layout::new(self.table, counts, self.options.plan, &self.limits)?;
        let block = |&(kind, bytes)| Buffer::new(&self.gpu, "buffers that share bindings", bytes, kind).map(Arc::new);
        let blocks = layout.blocks.iter().map(block).collect::<Result<Vec<_>>>()?;
        let part = |name: &str, (block, start): (usize, u64), bytes| Buffer::part(&blocks[block], name, start, bytes);
        self.table
            .iter()
            .zip(&layout.places)
            .map(|(decl, places)| {
                let bytes = memory::own_bytes(decl, counts, self.options.plan, self.limits.alignment())?;
                places.iter().map(|&place| part(decl.name, place, bytes)).collect()
            })
            .collect()
    }

    /// Moves all buffers outside of scratch to new blocks. Model buffers keep the common prefix. Needs memory for old
    /// and new blocks; without it, nothing changes.
    pub(super) fn resize_packed(&mut self, counts: &[u64]) -> Result<()> {
        if (0..self.table.len()).all(|index| matches!(self.grows(index, counts), Ok(None))) {
            return Ok(());
        }
        let fresh = self.packed(counts)?;
        let old = std::mem::replace(&mut self.storage.own, fresh);
        for (index, old) in old.iter().enumerate() {
            let decl = &self.table[index];
            if decl.class != Class::Model {
                continue;
            }
            let keep = memory::bytes_of(decl, counts)?.min(memory::bytes_of(decl, &self.counts)?);
            self.immediately(|recorder, storage, _| {
                let Ok(fresh) = storage.own_buffer(Buf(index as u16), 0) else { return Ok(()) };
                let keep = if old.is_empty() { 0 } else { keep };
                if fresh.bytes() > keep {
                    recorder.fill(fresh, keep, fresh.bytes() - keep, 0)?;
                }
                match old.first() {
                    Some(old) => recorder.copy((old, 0), (fresh, 0), keep),
                    None => Ok(()),
                }
            })?;
        }
        Ok(())
    }

    /// Returns the windows of a pass with the buffers of the first frame, for compiling; empty if buffers have their
    /// own bindings.
    pub(super) fn windows(&self, plan: &Plan, pass: &PassDecl) -> Result<Vec<u8>> {
        if !self.limits.is_packed() {
            return Ok(Vec::new());
        }
        Ok(bound(&self.gpu, &self.storage, plan, pass, 0)?.cover.window_of)
    }
}
