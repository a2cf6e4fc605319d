//! Finds accesses of buffers in no order.
//!
//! What an invocation writes, another sees only if both use a `coherent` buffer, or atomics.
//!
//! Every unit of memory (4 bytes, or 2 for shaders with 16-bit accesses) remembers its last write and its last reads
//! in the running dispatch. Atomics do not conflict with each other, but with plain accesses. `lane.rs` says what
//! orders two accesses. Between dispatches, everything is ordered: pipeline barriers are not checked.

use crate::lane::{Clock, Lane, MANY};
use std::collections::HashMap;

/// An access.
#[derive(Clone, Copy, Debug, Default)]
pub struct Access {
    /// The dispatch.
    dispatch: u32,
    /// Its workgroup.
    pub group: u32,
    /// Its invocation, or [`MANY`].
    pub lane: u16,
    subgroup: u16,
    subgroup_epoch: u32,
    time: u32,
    /// Its instruction.
    pub pc: u32,
    /// True for atomics.
    pub is_atomic: bool,
    /// True if it went through a `coherent` buffer.
    is_coherent: bool,
}

/// Last accesses of a unit.
#[derive(Clone, Debug, Default)]
pub struct Shadow {
    write: Access,
    read: Access,
}

/// Kinds of access.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum How {
    /// Plain read.
    Read,
    /// Plain write.
    Write,
    /// Atomic read.
    AtomicRead,
    /// Atomic write that may return the value before.
    Exchange,
    /// Atomic read and write.
    Atomic,
}

impl How {
    /// True if nothing is written.
    pub fn only_reads(self) -> bool {
        matches!(self, Self::Read | Self::AtomicRead)
    }

    /// True for atomics.
    pub fn is_atomic(self) -> bool {
        matches!(self, Self::AtomicRead | Self::Exchange | Self::Atomic)
    }
}

/// How two accesses conflict.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Conflict {
    /// They are in no order.
    Unordered,
    /// They are in order, but not both through a `coherent` buffer, so the first may not be visible to the second.
    Incoherent,
}

/// State of the running dispatch.
#[derive(Debug, Default)]
pub struct Races {
    dispatch: u32,
    /// What atomics on a word hand over.
    clocks: HashMap<(usize, u64), Clock>,
    /// Reads by workgroups other than the last.
    readers: HashMap<(usize, u64), Vec<Access>>,
}

impl Access {
    /// True if it comes before all that the invocation does now.
    fn is_before(&self, lane: &Lane) -> bool {
        let is_known = || lane.known.as_ref().is_some_and(|known| known.covers(self.group, self.lane, self.time));
        let is_ordered_here = || {
            self.lane == lane.number
                || self.time < lane.horizon
                || (self.lane != MANY && self.subgroup == lane.subgroup && self.subgroup_epoch < lane.subgroup_epoch)
        };
        (self.group == lane.group && is_ordered_here()) || is_known()
    }
}

impl Races {
    /// Begins a dispatch.
    pub fn begin(&mut self) {
        self.dispatch += 1;
        self.clocks.clear();
        self.readers.clear();
    }

    /// Notes an access of a unit. Returns an earlier one that it conflicts with.
    pub fn access(
        &mut self,
        (memory, unit): (usize, u64),
        shadow: &mut Shadow,
        lane: &Lane,
        (how, is_coherent): (How, bool),
        pc: u32,
    ) -> Option<(Access, Conflict)> {
        let mut now = Access {
            dispatch: self.dispatch,
            group: lane.group,
            lane: lane.number,
            subgroup: lane.subgroup,
            subgroup_epoch: lane.subgroup_epoch,
            time: lane.time,
            pc,
            is_atomic: how.is_atomic(),
            is_coherent,
        };
        let conflicts =
            |old: &Access| old.dispatch == now.dispatch && !(old.is_atomic && now.is_atomic) && !old.is_before(lane);
        let mut found = Some(shadow.write).filter(conflicts);
        let last = &shadow.write;
        let is_other = last.dispatch == now.dispatch && (last.group != lane.group || last.lane != lane.number);
        let is_plain = !last.is_atomic || !now.is_atomic;
        let hidden = is_other && is_plain && !(last.is_coherent && is_coherent);
        let hidden = hidden.then_some((shadow.write, Conflict::Incoherent));
        let unordered = |found: Option<Access>| found.map(|access| (access, Conflict::Unordered));
        if how.only_reads() {
            let old = shadow.read;
            if old.dispatch == now.dispatch && !old.is_before(lane) {
                if old.group == now.group {
                    // Several reads are plain if one of them is.
                    now.is_atomic &= old.is_atomic;
                    (now.lane, now.time, now.pc) = (MANY, now.time.max(old.time), old.pc);
                } else {
                    let others = self.readers.entry((memory, unit)).or_default();
                    others.retain(|other| other.group != old.group);
                    others.push(old);
                }
            }
            shadow.read = now;
            return unordered(found).or(hidden);
        }
        found = found.or(Some(shadow.read).filter(conflicts));
        if !self.readers.is_empty()
            && let Some(others) = self.readers.get(&(memory, unit))
        {
            found = found.or(others.iter().copied().find(conflicts));
        }
        shadow.write = now;
        unordered(found).or(hidden)
    }

    /// An atomic of an invocation hands over what it knows, and learns what was handed over.
    pub fn hand_over(&mut self, place: (usize, u64), lane: &mut Lane) {
        if lane.offers() || self.clocks.contains_key(&place) {
            lane.atomic(self.clocks.entry(place).or_default());
        }
    }
}
