//! Declarations of passes: shader, buffers, number of workgroups.

use super::buffers::Buf;
use crate::shaders::ShaderDesc;

/// A part of the work, by which reports sum times. The owner of the lists numbers and names its stages.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Stage {
    /// Position in the order of execution.
    pub order: u8,
    /// Name for tables.
    pub name: &'static str,
}

/// Number of workgroups of a pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Grid {
    /// Known when the list is prepared.
    Groups(u32, u32, u32),
    /// Written by an earlier pass: three u32 at this byte offset of the buffer.
    Indirect(Buf, u32),
}

/// One dispatch.
#[derive(Clone, Debug)]
pub struct PassDecl {
    /// Name in reports, timings and crash messages; by default the shader's name.
    pub label: String,
    /// Name in tables of times, shared by variants; by default the shader's stem.
    pub title: String,
    /// Stage of the work; set when the pass enters a list.
    pub stage: Stage,
    /// The shader variant.
    pub shader: &'static ShaderDesc,
    /// Buffers in the order of the shader's bindings.
    pub buffers: Vec<Buf>,
    /// Words of the specialisation constants and the pushed words, in the order of `ShaderDesc::spec`; empty for the
    /// defaults.
    pub spec: Vec<u32>,
    /// Number of workgroups.
    pub grid: Grid,
}

impl PassDecl {
    /// A pass with default specialisation constants.
    pub fn new(shader: &'static ShaderDesc, buffers: Vec<Buf>, grid: Grid) -> Self {
        let (label, title) = (shader.name.to_owned(), shader.stem.to_owned());
        Self { label, title, stage: Stage::default(), shader, buffers, spec: Vec::new(), grid }
    }

    /// Sets the specialisation constants.
    #[must_use]
    pub fn spec(mut self, words: Vec<u32>) -> Self {
        self.spec = words;
        self
    }

    /// Sets the name in reports.
    #[must_use]
    pub fn label(mut self, label: impl Into<String>) -> Self {
        self.label = label.into();
        self
    }
}

/// One item of a pass list.
#[derive(Clone, Debug)]
pub enum Work {
    /// A dispatch.
    Pass(PassDecl),
    /// Sets every word of a buffer.
    Fill {
        /// The buffer.
        buf: Buf,
        /// The word.
        word: u32,
        /// Stage of the work.
        stage: Stage,
    },
    /// Copies the first bytes of a buffer to the start of another buffer.
    Copy {
        /// Source.
        from: Buf,
        /// Destination.
        to: Buf,
        /// Number of bytes, a multiple of 4; 0 copies as many bytes as both buffers hold.
        bytes: u64,
        /// Stage of the work.
        stage: Stage,
    },
}

impl From<PassDecl> for Work {
    fn from(pass: PassDecl) -> Self {
        Self::Pass(pass)
    }
}

/// A list of work, planned, recorded and replayed as a unit.
#[derive(Clone, Debug, Default)]
pub struct PassList {
    /// Name in reports and messages.
    pub name: String,
    /// The work, in order.
    pub work: Vec<Work>,
    /// Stage of the items that follow.
    pub stage: Stage,
}

impl PassList {
    /// An empty list.
    pub fn new(name: impl Into<String>) -> Self {
        Self { name: name.into(), ..Self::default() }
    }

    /// The dispatches.
    pub(crate) fn passes(&self) -> impl Iterator<Item = &PassDecl> {
        self.work.iter().filter_map(|work| match work {
            Work::Pass(pass) => Some(pass),
            Work::Fill { .. } | Work::Copy { .. } => None,
        })
    }

    /// Appends a dispatch.
    pub fn pass(&mut self, pass: PassDecl) -> &mut Self {
        self.work.push(Work::Pass(PassDecl { stage: self.stage, ..pass }));
        self
    }

    /// Appends a fill.
    pub fn fill(&mut self, buf: Buf, word: u32) -> &mut Self {
        self.work.push(Work::Fill { buf, word, stage: self.stage });
        self
    }

    /// Appends a copy of `bytes` bytes; 0 copies as many bytes as both buffers hold.
    pub fn copy(&mut self, from: Buf, to: Buf, bytes: u64) -> &mut Self {
        self.work.push(Work::Copy { from, to, bytes, stage: self.stage });
        self
    }
}
