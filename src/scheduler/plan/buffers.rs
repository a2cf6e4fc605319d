//! Types for the rows of a table of buffers; the table itself is `plan/table.rs`.
//!
//! A buffer is an array of equal elements. The shaders declare its bindings (read, written, texel); the planner chooses
//! its place in memory by its class.

use super::capacity::Domain;

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
    /// The trained model and its state; kept when capacities change; never aliased.
    Model,
    /// Kept from step to step and never aliased; zeroed whenever it is (re)allocated.
    Persistent,
    /// Scratch of one pass list; buffers with disjoint lifetimes share bytes.
    Step,
    /// Written by the host for each step; one copy per frame, in host-visible memory.
    PerFrame,
    /// Written by the device, read by the host; one copy per frame, in host-cached memory.
    Report,
}

impl Class {
    /// Number of copies: two for buffers that the host shares with the steps in flight.
    pub fn copies(self) -> u64 {
        match self {
            Self::PerFrame | Self::Report => super::FRAMES_IN_FLIGHT as u64,
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
            Self::R32Uint | Self::R32Sfloat => 4,
        }
    }
}

/// One row of the table of buffers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BufferDecl {
    /// Plural noun, the same in GLSL, plan and reference.
    pub name: &'static str,
    /// Bytes per element; a multiple of 4.
    pub element_bytes: u32,
    /// Domain; its capacity is the number of elements.
    pub domain: Domain,
    /// Lifetime of the contents.
    pub class: Class,
    /// Format of the texel view, if shaders read the buffer as texels.
    pub texel: Option<TexelFormat>,
    /// Shape, unit and meaning.
    pub doc: &'static str,
}

/// Declares a table of buffers: `pub static TABLE: &[BufferDecl]`, and a constant for each row.
///
/// Each row is `NAME "name": element_bytes, domain, class, texel, "doc";`. The constants are `Buf::NAME`; with `consts;`
/// before the rows they are free, for tables of tests. `Buf` and `BufferDecl` have to be in scope.
#[doc(hidden)]
#[macro_export]
macro_rules! buffers {
    (consts; $($ident:ident $name:literal : $bytes:expr, $domain:expr, $class:expr, $texel:expr, $doc:literal;)*) => {
        $crate::buffers!(@table $($ident $name : $bytes, $domain, $class, $texel, $doc;)*);
        $(#[doc = $doc] #[allow(dead_code)] pub const $ident: Buf = Buf(BufferIndex::$ident as u16);)*
    };
    (@table $($ident:ident $name:literal : $bytes:expr, $domain:expr, $class:expr, $texel:expr, $doc:literal;)*) => {
        #[allow(non_camel_case_types, clippy::upper_case_acronyms, dead_code)]
        enum BufferIndex { $($ident),* }
        /// All rows of the table of buffers, in the order of their declaration.
        pub static TABLE: &[BufferDecl] = &[$(BufferDecl {
            name: $name, element_bytes: $bytes, domain: $domain, class: $class, texel: $texel, doc: $doc,
        }),*];
    };
    ($($ident:ident $name:literal : $bytes:expr, $domain:expr, $class:expr, $texel:expr, $doc:literal;)*) => {
        $crate::buffers!(@table $($ident $name : $bytes, $domain, $class, $texel, $doc;)*);
        impl Buf {
            $(#[doc = $doc] pub const $ident: Self = Self(BufferIndex::$ident as u16);)*
        }
    };
}
