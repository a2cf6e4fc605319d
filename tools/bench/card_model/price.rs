//! Time of a kernel on a card: one function, for the kernels of the engine and of other trainers.

use super::devices::{Card, DISPATCH, EFFICIENCY, SCHEDULERS};
use serde::Serialize;
use std::ops::AddAssign;

/// What a kernel does.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Work {
    /// Bytes of memory read, in sectors of 32 bytes, each counted once.
    pub read: f64,
    /// Bytes written, likewise.
    pub written: f64,
    /// Instructions of 32 lanes.
    pub instructions: f64,
    /// Of these: `exp2`, logarithms, reciprocals, roots.
    pub specials: f64,
    /// The longest chain of dependent steps of one lane.
    pub chain: Chain,
}

/// Steps that wait for each other.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Chain {
    /// Values from a multiprocessor's own cache.
    pub near: f64,
    /// Values from shared memory.
    pub shared: f64,
    /// Values from the cache that multiprocessors share.
    pub far: f64,
    /// Values from memory.
    pub memory: f64,
    /// Instructions, at the rate of the lane's scheduler.
    pub instructions: f64,
}

impl Chain {
    fn seconds(&self, card: &Card) -> f64 {
        let cycles = self.near * card.near_cycles
            + self.shared * card.shared_cycles
            + self.far * card.far_cycles
            + self.memory * card.memory_cycles
            + self.instructions * SCHEDULERS / card.issue;
        cycles / card.clock
    }
}

impl Work {
    /// Bytes read and written.
    pub fn bytes(&self) -> f64 {
        self.read + self.written
    }
}

impl AddAssign for Work {
    fn add_assign(&mut self, other: Self) {
        self.read += other.read;
        self.written += other.written;
        self.instructions += other.instructions;
        self.specials += other.specials;
    }
}

/// What bounds a kernel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub enum Bound {
    /// Bytes by bandwidth.
    Memory,
    /// Instructions by issue rate.
    Issue,
    /// Special functions by their rate.
    Special,
    /// One lane's chain of dependent steps.
    Chain,
}

impl Bound {
    /// Name for tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Memory => "memory",
            Self::Issue => "issue",
            Self::Special => "special",
            Self::Chain => "chain",
        }
    }
}

/// Seconds of one run of a kernel, without its start, and what bounds it.
pub fn seconds(work: &Work, card: &Card) -> (f64, Bound) {
    let bounds = [
        (work.bytes() / (card.bandwidth * EFFICIENCY), Bound::Memory),
        (work.instructions / (card.instructions() * EFFICIENCY), Bound::Issue),
        (work.specials / (card.specials() * EFFICIENCY), Bound::Special),
        (work.chain.seconds(card), Bound::Chain),
    ];
    bounds.into_iter().fold((0.0, Bound::Memory), |most, bound| if bound.0 > most.0 { bound } else { most })
}

/// Seconds of starting kernels, and of the barriers between them.
pub fn starts(dispatches: f64, barriers: f64, card: &Card) -> f64 {
    dispatches * DISPATCH + barriers * card.barrier()
}
