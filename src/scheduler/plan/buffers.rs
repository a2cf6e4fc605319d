//! Types for a table of buffers, which the owner of the pass lists declares.
//!
//! A buffer is an array of equal elements. The shaders declare its bindings (read, written, texel); the planner places
//! it by its class.

use super::Limits;
use crate::error::{Error, Result};
use std::ops::Deref;

/// A buffer: the index of its row in the table. [`buffers!`](crate::buffers) makes the constants.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Buf(pub u16);

impl Buf {
    /// Index of the buffer's row in the table.
    pub fn index(self) -> usize {
        usize::from(self.0)
    }
}

/// Lifetime of a buffer's contents, and who accesses them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Class {
    /// Kept, with its contents, when counts change; never aliased.
    Model,
    /// Kept from step to step and never aliased; zeroed whenever it is (re)allocated.
    Persistent,
    /// Scratch of one pass list; buffers with disjoint lifetimes share bytes.
    Step,
    /// Written by the host for each step; one copy per frame, in memory that the host sees or copied from such memory.
    PerFrame,
    /// Written by the device, read by the host; one copy per frame, in host-cached memory.
    Report,
}

impl Class {
    /// Returns true if each frame in flight has its own copy of the buffer.
    pub fn is_shared(self) -> bool {
        matches!(self, Self::PerFrame | Self::Report)
    }

    /// Returns the number of copies on a device: one per frame, followed by staging copies if there are any.
    pub fn copies(self, limits: &Limits) -> usize {
        match self {
            Self::PerFrame if limits.stages => 2 * limits.frames,
            Self::PerFrame | Self::Report => limits.frames,
            Self::Model | Self::Persistent | Self::Step => 1,
        }
    }

    /// Name for tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Model => "model",
            Self::Persistent => "persistent",
            Self::Step => "step",
            Self::PerFrame => "frame",
            Self::Report => "report",
        }
    }
}

/// Format of the texel view of a buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum TexelFormat {
    /// Four f32.
    Rgba32Sfloat,
    /// Two f32.
    Rg32Sfloat,
    /// One u32.
    R32Uint,
    /// One f32.
    R32Sfloat,
}

impl TexelFormat {
    /// Bytes of one texel.
    pub fn bytes(self) -> u32 {
        match self {
            Self::Rgba32Sfloat => 16,
            Self::Rg32Sfloat => 8,
            Self::R32Uint | Self::R32Sfloat => 4,
        }
    }
}

/// Number of elements of a buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Count {
    /// The same in every plan.
    Fixed(u32),
    /// Index into the counts that a plan is made with.
    At(usize),
}

/// What the elements of a buffer stand for.
#[derive(Clone, Copy, Debug)]
pub struct Domain {
    /// Number of elements.
    pub count: Count,
    /// Advice to the user if at most this many fit.
    pub cure: fn(u64) -> String,
    /// Memory reports omit the buffers while there are no elements.
    pub is_optional: bool,
}

impl Domain {
    /// A single element.
    pub const ONE: Self = Self::fixed(1);

    /// A fixed number of elements.
    pub const fn fixed(count: u32) -> Self {
        Self { count: Count::Fixed(count), cure: |_| "use another device".to_owned(), is_optional: false }
    }
}

/// One row of a table of buffers.
#[derive(Clone, Copy, Debug)]
pub struct BufferDecl {
    /// Plural noun, the same in GLSL, plan and reference.
    pub name: &'static str,
    /// Bytes per element; a multiple of 4.
    pub element_bytes: u32,
    /// What the elements stand for, and their number.
    pub domain: Domain,
    /// Lifetime of the contents.
    pub class: Class,
    /// Format of the texel view, if shaders read the buffer as texels.
    pub texel: Option<TexelFormat>,
    /// Shape, unit and meaning.
    pub doc: &'static str,
}

impl BufferDecl {
    /// Number of elements under these counts.
    pub fn count(&self, counts: &[u64]) -> Result<u64> {
        match self.domain.count {
            Count::Fixed(count) => Ok(count.into()),
            Count::At(place) => counts.get(place).copied().ok_or_else(|| {
                Error::Bug(format!("buffer {} needs count {place}, there are {}", self.name, counts.len()))
            }),
        }
    }
}

/// All buffers that pass lists may use.
#[derive(Debug)]
pub struct Table {
    /// One row per buffer.
    pub rows: &'static [BufferDecl],
    /// Advice to the user if the memory does not suffice for all buffers.
    pub cure: fn() -> String,
}

impl Deref for Table {
    type Target = [BufferDecl];

    fn deref(&self) -> &[BufferDecl] {
        self.rows
    }
}

/// Declares a table of buffers: `pub static TABLE: &Table`, and a constant for each row.
///
/// The first argument is the advice if the memory does not suffice. Each row is `NAME "name": element_bytes, domain,
/// class, texel, "doc";`. The constants are `Buf::NAME`; with `consts;` before the rows they are free constants, for
/// tests. `Buf`, `BufferDecl` and `Table` have to be in scope.
#[doc(hidden)]
#[macro_export]
macro_rules! buffers {
    (@table $cure:expr; $($ident:ident $name:literal : $bytes:expr, $domain:expr, $class:expr, $texel:expr,
    $doc:literal;)*) => {
        #[allow(non_camel_case_types, clippy::upper_case_acronyms, dead_code)]
        enum BufferIndex { $($ident),* }
        /// All buffers, in the order of their declaration.
        pub static TABLE: &Table = &Table {
            rows: &[$(BufferDecl {
                name: $name, element_bytes: $bytes, domain: $domain, class: $class, texel: $texel, doc: $doc,
            }),*],
            cure: $cure,
        };
    };
    ($cure:expr; consts; $($ident:ident $name:literal : $bytes:expr, $domain:expr, $class:expr, $texel:expr,
    $doc:literal;)*) => {
        $crate::buffers!(@table $cure; $($ident $name : $bytes, $domain, $class, $texel, $doc;)*);
        $(#[doc = $doc] #[allow(dead_code)] pub const $ident: Buf = Buf(BufferIndex::$ident as u16);)*
    };
    ($cure:expr; $($ident:ident $name:literal : $bytes:expr, $domain:expr, $class:expr, $texel:expr,
    $doc:literal;)*) => {
        $crate::buffers!(@table $cure; $($ident $name : $bytes, $domain, $class, $texel, $doc;)*);
        impl Buf {
            $(#[doc = $doc] pub const $ident: Self = Self(BufferIndex::$ident as u16);)*
        }
    };
}
