//! Shared memory of a workgroup, and who touched its words since the last barrier.

use crate::lane::{Lane, MANY};
use crate::races::How;

/// Accesses of a word since a barrier.
#[derive(Clone, Copy, Debug, Default)]
pub struct Touch {
    /// Barriers before, plus 1; 0 if there was none.
    epoch: u32,
    subgroup_epoch: u32,
    subgroup: u16,
    /// The invocation, or [`MANY`].
    pub lane: u16,
    /// True if invocations of several subgroups are meant.
    is_wide: bool,
    is_atomic: bool,
    /// The last instruction.
    pub pc: u32,
}

#[derive(Clone, Copy, Debug, Default)]
struct Word {
    value: u32,
    write: Touch,
    read: Touch,
    is_written: bool,
}

/// Shared memory.
#[derive(Clone, Debug, Default)]
pub struct SharedMemory(Vec<Word>);

impl Touch {
    fn conflicts(&self, lane: &Lane, is_atomic: bool) -> bool {
        let is_own = self.lane == lane.number;
        let is_earlier = !self.is_wide && self.subgroup == lane.subgroup && self.subgroup_epoch < lane.subgroup_epoch;
        let are_atomic = self.is_atomic && is_atomic;
        self.epoch == lane.epoch + 1 && !is_own && !is_earlier && !are_atomic
    }

    /// Adds an access. Those before it in the order of the subgroup are implied by it.
    fn add(&mut self, lane: &Lane, is_atomic: bool, pc: u32) {
        let old = *self;
        let (epoch, subgroup_epoch) = (lane.epoch + 1, lane.subgroup_epoch);
        // Several accesses are plain if one of them is.
        let is_atomic = is_atomic && (old.epoch != epoch || old.is_atomic);
        *self =
            Self { epoch, subgroup_epoch, subgroup: lane.subgroup, lane: lane.number, is_wide: false, is_atomic, pc };
        if old.epoch != epoch || old.lane == lane.number {
            return;
        }
        // Messages name the instruction of an earlier invocation.
        if old.is_wide || old.subgroup != lane.subgroup {
            (self.lane, self.is_wide, self.pc) = (MANY, true, old.pc);
        } else if old.subgroup_epoch == subgroup_epoch {
            (self.lane, self.pc) = (MANY, old.pc);
        }
    }
}

impl SharedMemory {
    /// Forgets all, for a new workgroup.
    pub fn reset(&mut self, words: u32, poison: u32) {
        self.0.clear();
        self.0.resize(words as usize, Word { value: poison, ..Word::default() });
    }

    /// The value of a word, if it is there.
    pub fn get(&self, place: u32) -> Option<u32> {
        self.0.get(place as usize).map(|word| word.value)
    }

    /// Sets a word that is there.
    pub fn set(&mut self, place: u32, value: u32) {
        let word = &mut self.0[place as usize];
        (word.value, word.is_written) = (value, true);
    }

    /// True if somebody has written the word.
    pub fn is_written(&self, place: u32) -> bool {
        self.0[place as usize].is_written
    }

    /// Notes an access. Returns an earlier one that it conflicts with.
    pub fn access(&mut self, place: u32, lane: &Lane, how: How, pc: u32) -> Option<Touch> {
        let word = &mut self.0[place as usize];
        let is_atomic = how.is_atomic();
        let mut found = Some(word.write).filter(|touch| touch.conflicts(lane, is_atomic));
        if how.only_reads() {
            word.read.add(lane, is_atomic, pc);
        } else {
            found = found.or(Some(word.read).filter(|touch| touch.conflicts(lane, is_atomic)));
            word.write.add(lane, is_atomic, pc);
        }
        found
    }
}
