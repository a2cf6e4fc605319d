//! The data of steps on their way to device memory, on devices that have memory of their own.
//!
//! The host writes to staging of the step's frame, and copies in front of the list take the data to the frame's
//! buffers. Data that come again, such as the photo of a view, are kept on the device while there is room, and come
//! from there.

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

/// Names data that come again: equal keys of a buffer have equal data.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct DataKey {
    /// Data of another round are not needed any more: they make room.
    pub round: u32,
    /// Item of the round.
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

/// The data of the steps in flight, and those that are kept.
pub(super) struct Loads {
    frames: Vec<Frame>,
    timeline: Timeline,
    submitted: u64,
    kept: HashMap<(Buf, DataKey), Arc<Buffer>>,
}

struct Frame {
    command: CommandBuffer,
    /// Copies in front of the next list.
    next: Vec<Load>,
    /// Those of the last list: they hold what it reads.
    last: Vec<Load>,
}

/// Copies of data of a buffer.
struct Load {
    buf: Buf,
    start: u64,
    bytes: u64,
    source: Source,
}

enum Source {
    Staging,
    /// From staging, and to a place where they are kept.
    Kept(Arc<Buffer>),
    /// From that place.
    Again(Arc<Buffer>),
}

impl Loads {
    /// Makes one if data go through staging on this device.
    pub(super) fn new(gpu: &Arc<Gpu>, frames: usize) -> Result<Self> {
        let command = || CommandBuffer::new(gpu, Lane::Transfer);
        let frame = || Ok(Frame { command: command()?, next: Vec::new(), last: Vec::new() });
        let frames = (0..frames).map(|_| frame()).collect::<Result<_>>()?;
        Ok(Self { frames, timeline: Timeline::new(gpu)?, submitted: 0, kept: HashMap::new() })
    }

    /// Bytes of the data that are kept.
    pub(super) fn kept_bytes(&self) -> u64 {
        self.kept.values().map(|kept| kept.bytes()).sum()
    }

    /// Submits the copies that the next list of a frame needs, by the queue for copies if the device has one. Returns
    /// what the list has to wait for, `None` if it needs nothing. No list of the frame runs.
    pub(super) fn submit(&mut self, gpu: &Gpu, storage: &Storage, frame: usize) -> Result<Option<(&Timeline, u64)>> {
        let count = self.frames.len();
        let of = &mut self.frames[frame];
        of.last = std::mem::take(&mut of.next);
        if of.last.is_empty() {
            return Ok(None);
        }
        let recorder = Recorder::begin(gpu, &of.command)?;
        for load in &of.last {
            let staging = (storage.own(load.buf, count + frame)?, load.start);
            let to = (storage.own(load.buf, frame)?, load.start);
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

    /// Adds a load in front of the next list, in the place of an earlier one of a list that was not submitted.
    fn push(&mut self, frame: usize, load: Load) {
        self.cancel(frame, |other| (other.buf, other.start) == (load.buf, load.start));
        self.frames[frame].next.push(load);
    }

    /// Forgets loads that were not recorded; what they should have filled is not kept.
    fn cancel(&mut self, frame: usize, is_meant: impl Fn(&Load) -> bool) {
        for load in self.frames[frame].next.extract_if(.., |load| is_meant(load)) {
            if let Source::Kept(place) = &load.source {
                self.kept.retain(|_, kept| !Arc::ptr_eq(kept, place));
            }
        }
    }

    /// Frees what is kept, after all submits. Returns whether there was something.
    fn free(&mut self) -> bool {
        self.frames.iter_mut().for_each(|frame| frame.last.clear());
        let was_kept = !self.kept.is_empty();
        self.kept.clear();
        was_kept
    }
}

impl Scheduler {
    /// Writes the first elements of a PerFrame buffer, which have a key if they come again; then `data` makes them
    /// once.
    ///
    /// Waits for the last list of the frame. On a device with memory of its own, data with a key come from the host
    /// once, as long as half of the memory that is left has room for them.
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
        self.storage.own(buf, self.limits.frames + frame)?.write(start, data)?;
        if let Some(loads) = &mut self.loads {
            loads.push(frame, Load { buf, start, bytes: data.len() as u64, source: Source::Staging });
        }
        Ok(())
    }

    /// Forgets the data of lists that were not submitted: their staging goes.
    pub(super) fn cancel_loads(&mut self) {
        if let Some(loads) = &mut self.loads {
            (0..loads.frames.len()).for_each(|frame| loads.cancel(frame, |_| true));
        }
    }

    /// Returns a place where data are kept from now on; `None` without room.
    fn place_for(&mut self, buf: Buf, key: DataKey, bytes: u64) -> Option<Arc<Buffer>> {
        let most = self.limits.kept_max(self.memory_total() - self.kept_bytes());
        let loads = self.loads.as_mut()?;
        if loads.kept_bytes() + bytes > most {
            loads.kept.retain(|(_, of), _| of.round == key.round);
        }
        if loads.kept_bytes() + bytes > most {
            return None;
        }
        // Without memory for it, the data come from the host again.
        let place = Arc::new(Buffer::new(&self.gpu, "kept data", bytes, MemoryKind::Device).ok()?);
        loads.kept.insert((buf, key), Arc::clone(&place));
        Some(place)
    }

    /// Bytes of the data that are kept on the device.
    pub fn kept_bytes(&self) -> u64 {
        self.loads.as_ref().map_or(0, Loads::kept_bytes)
    }

    /// Frees the data that are kept, to make room. Returns whether there were some.
    fn free_kept(&mut self) -> Result<bool> {
        self.wait_all()?;
        Ok(self.loads.as_mut().is_some_and(Loads::free))
    }

    /// Frees the data that are kept, and waits for the memory of snapshots. Returns whether there was something.
    pub(super) fn free_more(&mut self) -> Result<bool> {
        let was_kept = self.free_kept()?;
        Ok(self.wait_for_snapshots() || was_kept)
    }

    /// Frees the data that are kept unless `bytes` fit beside them.
    pub(super) fn make_room(&mut self, bytes: u64) -> Result<()> {
        if bytes.saturating_add(self.kept_bytes()) > self.limits.max_memory {
            self.free_kept()?;
        }
        Ok(())
    }
}
