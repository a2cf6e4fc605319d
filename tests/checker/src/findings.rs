//! What the checker reports.

use crate::program::Program;
use std::collections::HashSet;
use std::fmt;

/// Kinds of faults.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Kind {
    /// Invocations of a workgroup wait at different barriers, or some have ended.
    Barrier,
    /// Two invocations access a word of shared memory without a barrier between, and one writes.
    SharedRace,
    /// Two invocations access a word of a buffer in no order, and one writes.
    BufferRace,
    /// An invocation uses what another wrote, in order, but not both through a `coherent` buffer.
    Coherence,
    /// Invocations of a workgroup run different memory fences between two barriers.
    Fence,
    /// Invocations of a subgroup meet a subgroup operation without the others.
    Subgroup,
    /// A word of shared memory is read that nobody has written.
    Unwritten,
    /// The same of device memory.
    Stale,
    /// An access is outside of an array or a buffer.
    Bounds,
}

impl fmt::Display for Kind {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Barrier => "barrier in non-uniform flow",
            Self::SharedRace => "race in shared memory",
            Self::BufferRace => "race in a buffer",
            Self::Coherence => "use of a buffer that is not coherent",
            Self::Fence => "fence in non-uniform flow",
            Self::Subgroup => "subgroup operation in non-uniform flow",
            Self::Unwritten => "read of an unwritten word",
            Self::Stale => "read of unwritten device memory",
            Self::Bounds => "access out of bounds",
        })
    }
}

/// A fault, found once for each instruction and variable.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// Its kind.
    pub kind: Kind,
    /// Number of the SPIR-V instruction in its function, the first label being 0.
    pub instruction: u32,
    /// All that is known.
    pub text: String,
}

/// An invocation, for messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Invocation {
    /// Number of its workgroup.
    pub group: u32,
    /// Number in its workgroup.
    pub lane: u16,
}

impl fmt::Display for Invocation {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.lane {
            u16::MAX => write!(formatter, "several invocations of workgroup {}", self.group),
            lane => write!(formatter, "invocation {lane} of workgroup {}", self.group),
        }
    }
}

/// Findings of a dispatch.
#[derive(Debug, Default)]
pub struct Findings {
    seen: HashSet<(Kind, u32, u64)>,
    /// In the order of their discovery.
    pub list: Vec<Finding>,
}

impl Findings {
    /// Adds a finding, unless there is one of the same kind, instruction and subject.
    #[cold]
    pub fn add(&mut self, program: &Program, kind: Kind, pc: u32, subject: u64, what: impl FnOnce() -> String) {
        let instruction = program.origins[pc as usize];
        if !self.seen.insert((kind, instruction, subject)) {
            return;
        }
        let text = format!("{kind}: {}, at {}", what(), located(program, instruction));
        self.list.push(Finding { kind, instruction, text });
    }
}

/// The instruction, for people with a disassembly.
pub fn located(program: &Program, instruction: u32) -> String {
    let opcode = program.opcodes.get(instruction as usize).copied().unwrap_or("?");
    format!("instruction {instruction} (Op{opcode})")
}
