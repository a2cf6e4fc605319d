//! Uploads step data to device-local memory, on devices that have such memory.
//!
//! The host writes to the staging memory of the step's frame, and copies before the list transfer the data to the
//! frame's buffers. Reused data, such as a view's photo, stay on the device while there is room, and are copied from
//! there.

use super::Scheduler;
use super::recorder::Recorder;
use super::storage::Storage;
use crate::error::Result;
use crate::gpu::{Buffer, CommandBuffer, Gpu, Lane, MemoryKind, Timeline};
use crate::scheduler::plan::Buf;
use bytemuck::Pod;
use std::borrow::Cow;
use std::collections::HashMap;
use std::sync::Arc;

/// Key of reusable data: equal keys of a buffer mean equal data.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct DataKey {
    /// Data of other rounds are no longer needed and may be freed.
    pub round: u32,
    /// Item within the round.
    pub item: u32,
}

/// Bytes between host and device since the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Traffic {
    /// To the device.
    pub up: u64,
    /// From the device.
    pub down: u64,
}

/// Data of the steps in flight, and resident data.
pub(super) struct Loads {
    frames: Vec<Frame>,
    timeline: Timeline,
    submitted: u64,
    kept: HashMap<(Buf, DataKey), Arc<Buffer>>,
}

struct Frame {
    command: CommandBuffer,
    /// Copies before the next list.
    next: Vec<Load>,
    /// Copies of the last list, which keep its data alive.
    last: Vec<Load>,
}

/// Copies of a buffer's data.
struct Load {
    buf: Buf,
    start: u64,
    bytes: u64,
    source: Source,
}

enum Source {
    Staging,
    /// From staging, also into resident memory.
    Kept(Arc<Buffer>),
    /// From resident memory.
    Again(Arc<Buffer>),
}

impl Loads {
    /// Returns `Some` if data go through staging on this device.
    pub(super) fn new(gpu: &Arc<Gpu>, frames: usize) -> Result<Self> {
        let command = || CommandBuffer::new(gpu, Lane::Transfer);
        let frame = || Ok(Frame { command: command()?, next: Vec::new(), last: Vec::new() });
        let frames = (0..frames).map(|_| frame()).collect::<Result<_>>()?;
        Ok(Self { frames, timeline: Timeline::new(gpu)?, submitted: 0, kept: HashMap::new() })
    }

    /// Returns the bytes of resident data.
    pub(super) fn kept_bytes(&self) -> u64 {
        self.kept.values().map(|kept| kept.bytes()).sum()
    }

    /// Submits the copies that a frame's next list needs, on the transfer queue if there is one. Returns what the list
    /// has to wait for, if anything. No list of the frame may be running.
    pub(super) fn submit(&mut self, gpu: &Gpu, storage: &Storage, frame: usize) -> Result<Option<(&Timeline, u64)>> {
        let count = self.frames.len();
        let of = &mut self.frames[frame];
        of.last = std::mem::take(&mut of.next);
        if of.last.is_empty() {
            return Ok(None);
        }
        let recorder = Recorder::begin(gpu, &of.command)?;
        for load in &of.last {
            let staging = (storage.own_buffer(load.buf, count + frame)?, load.start);
            let to = (storage.own_buffer(load.buf, frame)?, load.start);
            match &load.source {
                Source::Staging => recorder.copy(staging, to, load.bytes)?,
                Source::Kept(kept) => {
                    recorder.copy(staging, to, load.bytes)?;
                    recorder.copy(staging, (kept, 0), load.bytes)?;
                }
                Source::Again(kept) => recorder.copy((kept, 0), to, load.bytes)?,
            }
        }
        recorder.end()?;
        gpu.submit(Lane::Transfer, &[&of.command], None, (&self.timeline, self.submitted + 1))?;
        self.submitted += 1;
        Ok(Some((&self.timeline, self.submitted)))
    }

    /// Blocks until all copies are done.
    pub(super) fn wait(&self) -> Result<()> {
        self.timeline.wait(self.submitted)
    }

    /// Adds a load before the next list. It replaces an earlier load of a list that was not submitted.
    fn push(&mut self, frame: usize, load: Load) {
        self.cancel(frame, |other| (other.buf, other.start) == (load.buf, load.start));
        self.frames[frame].next.push(load);
    }

    /// Drops loads that were not recorded, with the resident memory that they should have filled.
    fn cancel(&mut self, frame: usize, is_meant: impl Fn(&Load) -> bool) {
        for load in self.frames[frame].next.extract_if(.., |load| is_meant(load)) {
            if let Source::Kept(place) = &load.source {
                self.kept.retain(|_, kept| !Arc::ptr_eq(kept, place));
            }
        }
    }

    /// Frees resident data after all submits. Returns true if there were any.
    fn free(&mut self) -> bool {
        self.frames.iter_mut().for_each(|frame| frame.last.clear());
        let was_kept = !self.kept.is_empty();
        self.kept.clear();
        was_kept
    }
}

impl Scheduler {
    /// Writes the first elements of a PerFrame buffer. Reusable data have a key, and `data` makes them only once.
    ///
    /// Waits for the last list of the frame. On a device with local memory, data with a key are uploaded once, as long
    /// as they fit in half of the remaining memory.
    pub fn load<'a, T: Pod>(
        &mut self,
        buf: Buf,
        frame: usize,
        key: Option<DataKey>,
        data: impl FnOnce() -> Cow<'a, [T]>,
    ) -> Result<()> {
        self.check_frame(frame)?;
        if let (Some(loads), Some(key)) = (&mut self.loads, key)
            && let Some(kept) = loads.kept.get(&(buf, key))
        {
            let load = Load { buf, start: 0, bytes: kept.bytes(), source: Source::Again(Arc::clone(kept)) };
            loads.push(frame, load);
            return Ok(());
        }
        let data = data();
        self.upload(buf, frame, 0, &data)?;
        let Some(key) = key.filter(|_| !data.is_empty()) else { return Ok(()) };
        let kept = self.place_for(buf, key, std::mem::size_of_val(&*data) as u64);
        if let (Some(kept), Some(loads)) = (kept, &mut self.loads)
            && let Some(load) = loads.frames[frame].next.last_mut()
        {
            load.source = Source::Kept(kept);
        }
        Ok(())
    }

    /// Writes bytes to the staging of a frame that is not in use.
    pub(super) fn stage(&mut self, buf: Buf, frame: usize, start: u64, data: &[u8]) -> Result<()> {
        self.storage.own_buffer(buf, self.limits.frames + frame)?.write(start, data)?;
        if let Some(loads) = &mut self.loads {
            loads.push(frame, Load { buf, start, bytes: data.len() as u64, source: Source::Staging });
        }
        Ok(())
    }

    /// Drops the data of lists that were not submitted, because their staging memory is freed.
    pub(super) fn cancel_loads(&mut self) {
        if let Some(loads) = &mut self.loads {
            (0..loads.frames.len()).for_each(|frame| loads.cancel(frame, |_| true));
        }
    }

    /// Reserves resident memory for data; `None` if there is no room.
    fn place_for(&mut self, buf: Buf, key: DataKey, bytes: u64) -> Option<Arc<Buffer>> {
        let most = self.limits.kept_max(self.memory_total() - self.kept_bytes());
        let loads = self.loads.as_mut()?;
        if loads.kept_bytes() + bytes > most {
            loads.kept.retain(|(_, of), _| of.round == key.round);
        }
        if loads.kept_bytes() + bytes > most {
            return None;
        }
        // Without memory, the data are uploaded again every time.
        let place = Arc::new(Buffer::new(&self.gpu, "kept data", bytes, MemoryKind::Device).ok()?);
        loads.kept.insert((buf, key), Arc::clone(&place));
        Some(place)
    }

    /// Returns the bytes of resident data on the device.
    pub fn kept_bytes(&self) -> u64 {
        self.loads.as_ref().map_or(0, Loads::kept_bytes)
    }

    /// Frees resident data to make room. Returns true if there were any.
    fn free_kept(&mut self) -> Result<bool> {
        self.wait_all()?;
        Ok(self.loads.as_mut().is_some_and(Loads::free))
    }

    /// Frees resident data, and waits for the memory of snapshots. Returns true if there were any.
    pub(super) fn free_more(&mut self) -> Result<bool> {
        let was_kept = self.free_kept()?;
        Ok(self.wait_for_snapshots() || was_kept)
    }

    /// Frees resident data unless `bytes` fit beside them.
    pub(super) fn make_room(&mut self, bytes: u64) -> Result<()> {
        if bytes.saturating_add(self.kept_bytes()) > self.limits.max_memory {
            self.free_kept()?;
        }
        Ok(())
    }
}
