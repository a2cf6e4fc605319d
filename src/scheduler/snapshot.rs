//! Copies buffers between two lists, for another thread to read while lists continue.

use super::Scheduler;
use super::recorder::Recorder;
use crate::error::Result;
use crate::gpu::{Buffer, CommandBuffer, Gpu, Lane, MemoryKind, Timeline};
use crate::scheduler::plan::{Buf, memory};
use std::sync::Arc;
use std::thread;
use std::time::Duration;

/// Copies of buffers in device memory.
pub struct Snapshot {
    /// Allocated with the copies, so that reading needs no further device memory. The first field, because dropping it
    /// waits for the reads.
    halves: StagingHalves,
    /// Copies in the requested order; `None` for empty buffers.
    copies: Vec<Option<Buffer>>,
    /// The submit that makes the copies.
    made: (Arc<Timeline>, u64),
    /// The scheduler waits until this is dropped if memory is short.
    _alive: Arc<()>,
}

impl Scheduler {
    /// Copies the first words of buffers outside of scratch, after all lists so far. Fails if memory does not suffice.
    /// Another thread must read or drop the copies, because growth may wait for their memory.
    pub fn snapshot(&mut self, buffers: &[(Buf, u64)]) -> Result<Snapshot> {
        let bytes = buffers.iter().map(|(_, words)| words * 4).sum::<u64>();
        memory::check_total(self.table, "snapshot", self.memory_total().saturating_add(bytes), &self.limits)?;
        let mut copies = Vec::new();
        for &(buf, words) in buffers {
            self.range(buf, 0, 0, words * 4)?;
            let copy = |words: u64| Buffer::new(&self.gpu, "snapshot", words * 4, MemoryKind::Device);
            copies.push((words > 0).then(|| copy(words)).transpose()?);
        }
        let halves = StagingHalves::new(&self.gpu)?;
        let made = &copies;
        self.immediately(|recorder, storage, _| {
            for (&(buf, _), copy) in buffers.iter().zip(made) {
                let Some(copy) = copy else { continue };
                recorder.copy((storage.own_buffer(buf, 0)?, 0), (copy, 0), copy.bytes())?;
            }
            Ok(())
        })?;
        let alive = Arc::new(());
        self.snapshots.retain(|old| old.strong_count() > 0);
        self.snapshots.push(Arc::downgrade(&alive));
        let made = (Arc::clone(&self.timeline), self.submitted);
        Ok(Snapshot { copies, made, halves, _alive: alive })
    }

    /// Waits until other threads have read all snapshots, so that their timing does not affect what fits in memory.
    /// Returns true if there were any.
    pub(super) fn wait_for_snapshots(&mut self) -> bool {
        let was_there = self.snapshots.iter().any(|snapshot| snapshot.strong_count() > 0);
        while self.snapshots.iter().any(|snapshot| snapshot.strong_count() > 0) {
            thread::sleep(Duration::from_millis(1));
        }
        self.snapshots.clear();
        was_there
    }
}

impl Snapshot {
    /// Reads the words of all copies, on the transfer queue if there is one. Any thread may call this.
    pub fn read(mut self) -> Result<Vec<Vec<u32>>> {
        let mut all = Vec::new();
        for copy in &self.copies {
            let mut words = vec![0_u32; copy.as_ref().map_or(0, |copy| copy.bytes() as usize / 4)];
            if let Some(copy) = copy {
                self.halves.read(copy, bytemuck::cast_slice_mut(&mut words), (&self.made.0, self.made.1))?;
            }
            all.push(words);
        }
        Ok(all)
    }
}

/// Two halves of staging memory: one is filled while the other is read.
struct StagingHalves {
    gpu: Arc<Gpu>,
    staging: [Buffer; 2],
    commands: [CommandBuffer; 2],
    timeline: Timeline,
    submitted: u64,
}

impl StagingHalves {
    fn new(gpu: &Arc<Gpu>) -> Result<Self> {
        let staging = || Buffer::new(gpu, "staging down", memory::STAGING_BYTES / 2, MemoryKind::Download);
        let command = || CommandBuffer::new(gpu, Lane::Transfer);
        Ok(Self {
            gpu: Arc::clone(gpu),
            staging: [staging()?, staging()?],
            commands: [command()?, command()?],
            timeline: Timeline::new(gpu)?,
            submitted: 0,
        })
    }

    /// Reads a whole buffer after a timeline has reached a value.
    fn read(&mut self, from: &Buffer, to: &mut [u8], after: (&Timeline, u64)) -> Result<()> {
        let half = self.staging[0].bytes() as usize;
        let mut waiting: Option<(u64, &mut [u8])> = None;
        for (piece, to) in to.chunks_mut(half).enumerate() {
            let value = self.submitted + 1;
            let side = value as usize % 2;
            let recorder = Recorder::begin(&self.gpu, &self.commands[side])?;
            recorder.copy((from, (piece * half) as u64), (&self.staging[side], 0), to.len() as u64)?;
            recorder.end()?;
            self.gpu.submit(Lane::Transfer, &[&self.commands[side]], Some(after), (&self.timeline, value))?;
            self.submitted = value;
            if let Some((value, to)) = waiting.replace((value, to)) {
                self.take(value, to)?;
            }
        }
        waiting.map_or(Ok(()), |(value, to)| self.take(value, to))
    }

    fn take(&self, value: u64, to: &mut [u8]) -> Result<()> {
        self.timeline.wait(value)?;
        self.staging[value as usize % 2].read(0, to)
    }
}

impl Drop for StagingHalves {
    fn drop(&mut self) {
        // Memory in use must not be freed.
        let _ = self.timeline.wait(self.submitted);
    }
}
