//! One command buffer: a planned list with the host-visible buffers of one frame.

use super::SchedulerOptions;
use super::guard;
use super::packed;
use super::recorder::{Groups, Recorder};
use super::storage::Storage;
use crate::error::{Error, Result};
use crate::gpu::limits::PACKED_SLOT;
use crate::gpu::{
    Binding, Buffer, BufferView, CommandBuffer, DescriptorPool, Gpu, Lane, Markers, MemoryKind, QueryPool,
};
use crate::scheduler::plan::windows::Span;
use crate::scheduler::plan::{Buf, Class, Grid, PassDecl, Plan, TexelFormat, Uses, Work};
use crate::shaders::{BindingKind, PUSHED_WORDS};
use ash::vk;
use std::collections::HashMap;
use std::sync::Arc;

/// A recorded list, ready for any number of submits.
pub(super) struct Recording {
    pub(super) command: CommandBuffer,
    pub(super) queries: Option<QueryPool>,
    pub(super) markers: Option<Markers>,
    /// Timeline value of the last submit.
    pub(super) busy: u64,
    _descriptors: DescriptorPool,
    _places: Option<Buffer>,
    _views: HashMap<Buf, BufferView>,
}

/// Inputs for the recording of one list.
struct Writer<'a> {
    gpu: &'a Arc<Gpu>,
    plan: &'a Plan,
    storage: &'a Storage,
    frame: usize,
    recorder: Recorder<'a>,
    descriptors: &'a DescriptorPool,
    /// With shared bindings: the buffer offsets, one slot per item.
    places: Option<&'a Buffer>,
    views: &'a HashMap<Buf, BufferView>,
}

impl Recording {
    pub(super) fn new(
        gpu: &Arc<Gpu>,
        plan: &Plan,
        storage: &Storage,
        frame: usize,
        options: SchedulerOptions,
    ) -> Result<Self> {
        let items = plan.items.len();
        let counts = plan.descriptors;
        let command = CommandBuffer::new(gpu, Lane::Compute)?;
        let descriptors = DescriptorPool::new(gpu, counts.sets, counts.storage, counts.texel)?;
        let timed = options.timestamps && gpu.limits().timestamp_bits > 0;
        let queries = timed.then(|| QueryPool::new(gpu, items as u32 + 1)).transpose()?;
        let markers = options.crash_markers.then(|| Markers::new(gpu, items)).transpose()?;
        let views = views(gpu, plan, storage, frame)?;
        let slots = u64::from(PACKED_SLOT) * items.max(1) as u64;
        let is_packed = gpu.limits().plan.is_packed();
        let places = is_packed.then(|| Buffer::new(gpu, "places of buffers", slots, MemoryKind::Upload)).transpose()?;
        let recorder = Recorder::begin(gpu, &command)?;
        let (descriptors_, places_) = (&descriptors, places.as_ref());
        let writer =
            Writer { gpu, plan, storage, frame, recorder, descriptors: descriptors_, places: places_, views: &views };
        writer.prologue(queries.as_ref())?;
        for item in 0..items {
            writer.item(item, queries.as_ref(), markers.as_ref())?;
        }
        writer.recorder.end()?;
        Ok(Self { command, queries, markers, busy: 0, _descriptors: descriptors, _places: places, _views: views })
    }
}

impl Writer<'_> {
    /// Writes the guards and resets the timestamps.
    fn prologue(&self, queries: Option<&QueryPool>) -> Result<()> {
        if self.plan.options.guards {
            write_scratch_guards(&self.recorder, self.plan, self.storage)?;
            self.recorder.barrier(Uses::ALL, Uses::ALL);
        }
        if let Some(queries) = queries {
            self.recorder.reset_timestamps(queries);
            self.recorder.timestamp(queries, 0)?;
        }
        Ok(())
    }

    fn item(&self, index: usize, queries: Option<&QueryPool>, markers: Option<&Markers>) -> Result<()> {
        if let Some(barrier) = &self.plan.items[index].barrier {
            self.recorder.barrier(barrier.src, barrier.dst);
        }
        if let Some(markers) = markers {
            self.recorder.fill(markers.buffer(), index as u64 * 4, 4, 1)?;
        }
        match &self.plan.list.work[index] {
            Work::Pass(pass) => self.pass(pass, index)?,
            Work::Fill { buf, word, .. } => {
                let (buffer, offset) = self.storage.place(self.plan, *buf, self.frame)?;
                self.recorder.fill(buffer, offset, self.plan.placement(*buf)?.bytes, *word)?;
            }
            Work::Copy { from, to, bytes, .. } => {
                let most = self.plan.placement(*from)?.bytes.min(self.plan.placement(*to)?.bytes);
                let bytes = if *bytes == 0 { most } else { *bytes };
                let from = self.storage.place(self.plan, *from, self.frame)?;
                let to = self.storage.place(self.plan, *to, self.frame)?;
                self.recorder.copy(from, to, bytes)?;
            }
        }
        if let Some(queries) = queries {
            self.recorder.timestamp(queries, index as u32 + 1)?;
        }
        Ok(())
    }

    fn pass(&self, pass: &PassDecl, index: usize) -> Result<()> {
        let (mut bindings, windows) = match self.places {
            Some(places) => self.windows(pass, places, u64::from(PACKED_SLOT) * index as u64)?,
            None => (Vec::new(), Vec::new()),
        };
        let pipeline = self.gpu.pipeline(pass.shader, &pass.spec, &windows)?;
        for (binding, &buf) in pass.shader.bindings.iter().zip(&pass.buffers) {
            bindings.push(match binding.kind {
                BindingKind::Storage if !windows.is_empty() => continue,
                BindingKind::Storage => {
                    let (buffer, offset) = self.storage.place(self.plan, buf, self.frame)?;
                    Binding::Storage { buffer, offset, bytes: self.plan.placement(buf)?.bound }
                }
                BindingKind::Texel => {
                    let view = self.views.get(&buf);
                    Binding::Texel(view.ok_or_else(|| Error::Bug(format!("no texel view of buffer {}", buf.0)))?)
                }
            });
        }
        let set = self.descriptors.set(&pipeline, &bindings)?;
        let groups = match pass.grid {
            Grid::Groups(x, y, z) => Groups::Count([x, y, z]),
            Grid::Indirect(buf, inner) => {
                let (buffer, offset) = self.storage.place(self.plan, buf, self.frame)?;
                Groups::Indirect(buffer, offset + u64::from(inner))
            }
        };
        let mut pushed = None;
        for (constant, &word) in pass.shader.spec.iter().zip(&pass.spec).filter(|(constant, _)| constant.is_pushed) {
            pushed.get_or_insert([0; PUSHED_WORDS])[constant.id as usize] = word;
        }
        self.recorder.dispatch(&pipeline, set, pushed, &groups)
    }

    /// Returns the windows of a pass's storage buffers, with the buffer offsets, and the window of each buffer.
    fn windows<'b>(&'b self, pass: &PassDecl, places: &'b Buffer, slot: u64) -> Result<(Vec<Binding<'b>>, Vec<u8>)> {
        let bound = packed::bound(self.gpu, self.storage, self.plan, pass, self.frame)?;
        let limits = self.gpu.limits().plan;
        let (most, found) = (limits.windows as usize, bound.cover.windows.len());
        if found > most {
            return Err(Error::Bug(format!(
                "pass {} has {found} windows; the device binds at most {most}",
                pass.label
            )));
        }
        if found == 0 {
            return Ok((Vec::new(), Vec::new()));
        }
        places.write(slot, bytemuck::cast_slice(&bound.places))?;
        let window = |(span, buffer): (&Span<u64>, &&'b Buffer)| {
            // Window offsets are relative to the handle.
            Binding::Storage {
                buffer: buffer.whole(),
                offset: span.start,
                bytes: (span.end - span.start).min(limits.max_storage_range),
            }
        };
        let windows = bound.cover.windows.iter().zip(&bound.buffers).map(window);
        let places = Binding::Uniform { buffer: places, offset: slot, bytes: PACKED_SLOT.into() };
        Ok((windows.chain([places]).collect(), bound.cover.window_of))
    }
}

/// Creates a view of each buffer that a pass reads as texels.
fn views(gpu: &Arc<Gpu>, plan: &Plan, storage: &Storage, frame: usize) -> Result<HashMap<Buf, BufferView>> {
    let mut views = HashMap::new();
    for work in &plan.list.work {
        let Work::Pass(pass) = work else { continue };
        for (binding, &buf) in pass.shader.bindings.iter().zip(&pass.buffers) {
            if binding.kind != BindingKind::Texel || views.contains_key(&buf) {
                continue;
            }
            let decl = &plan.table[buf.index()];
            let format = decl.texel.ok_or_else(|| Error::Bug(format!("{} has no texel format", decl.name)))?;
            let (buffer, offset) = storage.place(plan, buf, frame)?;
            let bytes = plan.placement(buf)?.bytes;
            views.insert(buf, BufferView::new(gpu, buffer, vulkan_format(format), offset, bytes)?);
        }
    }
    Ok(views)
}

fn vulkan_format(format: TexelFormat) -> vk::Format {
    match format {
        TexelFormat::Rgba32Sfloat => vk::Format::R32G32B32A32_SFLOAT,
        TexelFormat::Rg32Sfloat => vk::Format::R32G32_SFLOAT,
        TexelFormat::R32Uint => vk::Format::R32_UINT,
        TexelFormat::R32Sfloat => vk::Format::R32_SFLOAT,
    }
}

/// Writes the guards of the scratch buffers of a plan.
fn write_scratch_guards(recorder: &Recorder<'_>, plan: &Plan, storage: &Storage) -> Result<()> {
    for (index, decl) in plan.table.iter().enumerate() {
        if let (Class::Step, Some(place)) = (decl.class, plan.placements[index]) {
            let (buffer, offset) = storage.place(plan, Buf(index as u16), 0)?;
            guard::write(recorder, buffer, offset + place.bytes)?;
        }
    }
    Ok(())
}
