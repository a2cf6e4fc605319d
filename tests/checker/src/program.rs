//! A compute shader as the interpreter runs it: a list of instructions on single words.
//!
//! Vectors, matrices and structs are words of their own; an instruction on a vector is one for each component.
//! Phis are moves at the end of the blocks before. Every place in memory is a constant plus a computed offset.

use crate::ops::{Binary, Ternary, Unary};

/// A word that an instruction reads: a register, or a constant if the highest bit is set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Source(pub u32);

impl Source {
    const CONSTANT: u32 = 1 << 31;

    /// The constant with this place in [`Program::constants`].
    pub fn constant(place: usize) -> Self {
        Self(place as u32 | Self::CONSTANT)
    }

    /// Place of the constant, or the register.
    pub fn place(self) -> Result<usize, usize> {
        match self.0 & Self::CONSTANT {
            0 => Err(self.0 as usize),
            _ => Ok((self.0 & !Self::CONSTANT) as usize),
        }
    }
}

/// Number of a register.
pub type Register = u32;

/// Memory that a [`Place`] is in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Space {
    /// A storage or uniform buffer, by its place in [`Program::bindings`]; offsets are bytes.
    Buffer(u16),
    /// Push constants; offsets are bytes.
    Push,
    /// Shared memory of the workgroup; offsets are words.
    Shared,
    /// A variable of the invocation: words from this register on.
    Local(Register),
}

/// A place in memory, `plus` + `at` from the start.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// The memory.
    pub space: Space,
    /// Constant part of the offset.
    pub plus: u32,
    /// Computed part of the offset.
    pub at: Option<Source>,
}

/// Read-modify-write operations on memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Atomic {
    /// A binary operation.
    Binary(Binary),
    /// Replaces the value.
    Exchange,
    /// Replaces the value if it equals the comparator.
    CompareExchange,
    /// Reads only.
    Load,
    /// Writes only.
    Store,
}

/// How the lanes of a subgroup combine values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exchange {
    /// True in the first active lane.
    Elect,
    /// Lanes whose value is true, 32 of them from this lane on.
    Ballot(u32),
    /// Value of the lane that the second operand names.
    Shuffle,
    /// Value of the lane whose number differs by the second operand.
    ShuffleXor,
    /// Value of the first active lane.
    BroadcastFirst,
    /// True if all values are.
    All,
    /// True if any value is.
    Any,
    /// Combination of all values.
    Reduce(Binary),
    /// Combination of this and all lower lanes.
    InclusiveScan(Binary),
    /// Combination of all lower lanes; the constant is the value of the lowest.
    ExclusiveScan(Binary, u32),
    /// Only orders memory.
    Barrier,
}

/// Kind, scope and memory of a fence or barrier.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Semantics {
    /// Scope of the memory: 1 device, 2 workgroup, 3 subgroup.
    pub scope: u32,
    /// Bits of SPIR-V's memory semantics.
    pub bits: u32,
}

impl Semantics {
    /// True if it orders at all.
    pub fn orders(self) -> bool {
        self.bits & 0x1e != 0
    }

    /// True if it orders buffers among all invocations of a workgroup.
    pub fn orders_buffers(self) -> bool {
        self.orders() && self.bits & 0x40 != 0 && self.scope != 3
    }

    /// True if it orders shared memory.
    pub fn orders_shared(self) -> bool {
        self.orders() && self.bits & 0x100 != 0
    }

    /// True if it orders among workgroups.
    pub fn is_device(self) -> bool {
        self.scope <= 1 || self.scope == 5
    }
}

/// One instruction. Targets are places in [`Program::code`].
#[derive(Clone, Debug)]
#[allow(missing_docs, reason = "the fields say what the operands of SPIR-V are")]
pub enum Instruction {
    Unary {
        op: Unary,
        to: Register,
        a: Source,
    },
    Binary {
        op: Binary,
        to: Register,
        a: Source,
        b: Source,
    },
    Ternary {
        op: Ternary,
        to: Register,
        a: Source,
        b: Source,
        c: Source,
    },
    Move {
        to: Register,
        from: Source,
    },
    /// `to` = `base` + `index` * `stride`, saturated; an `index` of `bound` or more is a finding.
    Offset {
        to: Register,
        base: Option<Source>,
        index: Source,
        stride: u32,
        bound: u32,
    },
    /// Reads 4 or 2 bytes.
    Load {
        to: Register,
        place: Place,
        width: u32,
    },
    Store {
        place: Place,
        from: Source,
        width: u32,
    },
    Atomic {
        op: Atomic,
        to: Register,
        place: Place,
        value: Source,
        comparator: Source,
    },
    /// Bytes of a buffer from `plus` on, divided by `stride`.
    Length {
        to: Register,
        binding: u16,
        plus: u32,
        stride: u32,
    },
    /// One component of an element of a texel buffer.
    Fetch {
        to: Register,
        binding: u16,
        index: Source,
        component: u32,
    },
    Exchange {
        op: Exchange,
        to: Register,
        a: Source,
        b: Source,
    },
    Barrier(Semantics),
    /// A fence of its own, or a part of an atomic instruction.
    Fence {
        semantics: Semantics,
        is_part: bool,
    },
    Jump(u32),
    Branch {
        condition: Source,
        yes: u32,
        no: u32,
    },
    Switch {
        value: Source,
        default: u32,
        cases: Vec<(u32, u32)>,
    },
    Return,
}

/// A binding that the shader uses, of set 0.
#[derive(Clone, Copy, Debug)]
pub struct BindingUse {
    /// Its number.
    pub number: u32,
    /// True if the shader may write it.
    pub is_written: bool,
    /// True if other invocations see what is written: `coherent` of GLSL.
    pub is_coherent: bool,
}

/// Values of an invocation that the device sets, each with its first register.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names of SPIR-V")]
pub enum Builtin {
    NumWorkgroups,
    WorkgroupId,
    LocalInvocationId,
    LocalInvocationIndex,
    GlobalInvocationId,
    SubgroupId,
    SubgroupLocalInvocationId,
    SubgroupSize,
    NumSubgroups,
}

/// A shader with its specialisation constants.
#[derive(Clone, Debug, Default)]
pub struct Program {
    /// Instructions; the first is the entry.
    pub code: Vec<Instruction>,
    /// Number of the SPIR-V instruction in the function that each instruction comes from.
    pub origins: Vec<u32>,
    /// Opcodes of the function, by number of the SPIR-V instruction.
    pub opcodes: Vec<&'static str>,
    /// Values of constants.
    pub constants: Vec<u32>,
    /// Registers of an invocation.
    pub registers: u32,
    /// Registers of built-in values and variables, which come first.
    pub pinned: u32,
    /// Words of shared memory.
    pub shared_words: u32,
    /// Bindings in use.
    pub bindings: Vec<BindingUse>,
    /// Built-in values in use.
    pub builtins: Vec<(Builtin, Register)>,
    /// Invocations of a workgroup along each axis.
    pub local_size: [u32; 3],
    /// Bytes of the units whose accesses are told apart: 2 if the shader has 16-bit accesses, else 4.
    pub granule: u32,
    /// Hash of the SPIR-V.
    pub hash: u64,
}

/// Hash that names a module in findings and in the log (FNV-1a).
pub fn module_hash(words: &[u32]) -> u64 {
    let bytes = words.iter().flat_map(|word| word.to_le_bytes());
    bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

impl Builtin {
    /// True if it has three components.
    pub fn is_vector(self) -> bool {
        matches!(self, Self::NumWorkgroups | Self::WorkgroupId | Self::LocalInvocationId | Self::GlobalInvocationId)
    }
}
