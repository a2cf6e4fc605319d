//! The planner: derives sizes, placements and barriers from a table of buffers, element counts, a pass list and device
//! limits.
//!
//! These are pure functions without Vulkan. A plan exists before anything is allocated, can be printed
//! ([`Plan::report`]) and is tested without a GPU. The same input gives the same plan, byte for byte.

mod arena;
pub(crate) mod barrier;
pub(crate) mod buffers;
mod check;
mod lifetime;
pub(crate) mod memory;
pub(crate) mod pass;
mod report;
pub(crate) mod windows;

pub use crate::gpu::limits::PlanLimits as Limits;
pub use barrier::Use;
pub(crate) use barrier::{Barrier, Touch, Uses};
pub use buffers::{Buf, BufferDecl, Class, Count, Domain, Table, TexelFormat};
pub(crate) use lifetime::Lifetime;
pub use memory::MemoryReport;
pub use pass::{Grid, PassDecl, PassList, Stage, Work};

use crate::error::{Error, Result};
use crate::shaders::BindingKind;

/// Bytes of the guard after each buffer in test mode.
pub(crate) const GUARD_BYTES: u64 = 256;

/// Options of a plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PlanOptions {
    /// Step buffers with disjoint lifetimes share bytes.
    pub alias: bool,
    /// A guard after each buffer. Guards turn aliasing off, because a neighbour in shared bytes would overwrite them.
    pub guards: bool,
    /// A full barrier before each item, so that each measured time belongs to one item. Results do not change.
    pub barrier_everywhere: bool,
}

impl Default for PlanOptions {
    fn default() -> Self {
        Self { alias: true, guards: false, barrier_everywhere: false }
    }
}

impl PlanOptions {
    /// Returns true if Step buffers may share bytes.
    pub fn aliases(&self) -> bool {
        self.alias && !self.guards
    }
}

/// The memory that contains a buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Page {
    /// Its own VkBuffer (one per frame in flight for classes with copies).
    Own(Buf),
    /// A page of the Step arena.
    Step(u32),
}

/// Place of a buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Placement {
    /// The memory.
    pub page: Page,
    /// Byte offset in the page.
    pub offset: u64,
    /// Bytes of the elements, at least one element.
    pub bytes: u64,
    /// Bytes bound to shaders: the elements and, if enabled, the guard, so that it catches writes past the end.
    pub bound: u64,
}

/// Number of descriptors per frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DescriptorCounts {
    /// Descriptor sets: one per pass.
    pub sets: u32,
    /// Storage buffers.
    pub storage: u32,
    /// Texel buffers.
    pub texel: u32,
}

/// A planned item of a pass list.
#[derive(Clone, Debug)]
pub struct PlanItem {
    /// Name in reports.
    pub label: String,
    /// Memory that the item uses.
    pub touches: Vec<Touch>,
    /// The barrier before it.
    pub barrier: Option<Barrier>,
}

/// A planned pass list.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The table of buffers.
    pub table: &'static Table,
    /// The list.
    pub list: PassList,
    /// Numbers of elements, where domains look them up.
    pub counts: Vec<u64>,
    /// The options.
    pub options: PlanOptions,
    /// Place of each buffer by row of the table; `None` for Step buffers outside of the list.
    pub placements: Vec<Option<Placement>>,
    /// First and last use of each buffer.
    pub lives: Vec<Option<Lifetime>>,
    /// Bytes of each page of the Step arena.
    pub step_pages: Vec<u64>,
    /// The items, one for each of the list.
    pub items: Vec<PlanItem>,
    /// Descriptors per frame.
    pub descriptors: DescriptorCounts,
}

impl Plan {
    /// Plans a pass list.
    pub fn new(
        table: &'static Table,
        counts: &[u64],
        list: &PassList,
        limits: &Limits,
        options: PlanOptions,
    ) -> Result<Self> {
        let sizes = memory::sizes(table, counts)?;
        check::list(table, &sizes, list, limits)?;
        let labels = list.work.iter().map(|work| label(table, work)).collect::<Vec<_>>();
        let uses = list.work.iter().map(|work| barrier::uses(work, &sizes)).collect::<Vec<_>>();
        let lives = lifetime::lives(table.len(), &uses);
        if options.aliases() {
            lifetime::check_written_first(table, &labels, &uses)?;
        }
        let (placements, step_pages) = arena::place(table, &sizes, &lives, limits, options)?;
        if limits.is_packed() {
            windows::check(table, counts, list, &placements, (limits, options))?;
        }
        let touches = uses.iter().map(|uses| barrier::touches(uses, &placements)).collect::<Result<Vec<_>>>()?;
        let barriers = barrier::derive(table, &labels, &touches, options.barrier_everywhere);
        let items = labels.into_iter().zip(touches).zip(barriers);
        let items = items.map(|((label, touches), barrier)| PlanItem { label, touches, barrier }).collect();
        let descriptors = count_descriptors(list);
        let (list, counts) = (list.clone(), counts.to_vec());
        Ok(Self { table, list, counts, options, placements, lives, step_pages, items, descriptors })
    }

    /// Returns the placement of a buffer; a scratch buffer must be part of the list.
    pub fn placement(&self, buf: Buf) -> Result<Placement> {
        self.placements.get(buf.index()).copied().flatten().ok_or_else(|| {
            Error::Bug(format!("pass list {} does not touch buffer {}", self.list.name, name(self.table, buf)))
        })
    }

    /// Total bytes of the Step arena.
    pub fn step_bytes(&self) -> u64 {
        self.step_pages.iter().sum()
    }

    /// Returns the buffer that overwrites a Step buffer after its last use, if any.
    pub fn overwritten_by(&self, buf: Buf) -> Option<Buf> {
        let place = self.placements.get(buf.index()).copied().flatten()?;
        let life = self.lives.get(buf.index()).copied().flatten()?;
        (0..self.table.len()).map(|index| Buf(index as u16)).find(|&other| {
            let (Some(place2), Some(life2)) = (self.placements[other.index()], self.lives[other.index()]) else {
                return false;
            };
            other != buf
                && place2.page == place.page
                && place2.offset < place.offset + place.bound
                && place.offset < place2.offset + place2.bound
                && life2.last > life.last
        })
    }

    /// Number of barriers.
    pub fn barrier_count(&self) -> usize {
        self.items.iter().filter(|item| item.barrier.is_some()).count()
    }
}

/// Name of a buffer, for messages; also for invalid rows.
pub(crate) fn name(table: &'static Table, buf: Buf) -> &'static str {
    table.get(buf.index()).map_or("(no such buffer)", |decl| decl.name)
}

fn label(table: &'static Table, work: &Work) -> String {
    match work {
        Work::Pass(pass) => pass.label.clone(),
        Work::Fill { buf, .. } => format!("fill {}", name(table, *buf)),
        Work::Copy { from, to, .. } => format!("copy {} to {}", name(table, *from), name(table, *to)),
    }
}

fn count_descriptors(list: &PassList) -> DescriptorCounts {
    let mut counts = DescriptorCounts::default();
    for work in &list.work {
        if let Work::Pass(pass) = work {
            counts.sets += 1;
            for binding in pass.shader.bindings {
                match binding.kind {
                    BindingKind::Storage => counts.storage += 1,
                    BindingKind::Texel => counts.texel += 1,
                }
            }
        }
    }
    counts
}
