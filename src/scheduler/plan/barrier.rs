//! Finds hazards on byte ranges, and the barriers that remove them.
//!
//! Hazards compare byte ranges, not buffers. Aliasing therefore needs no special rule: reuse of bytes is a write after
//! a read, like any other. All barriers are global memory barriers: a barrier orders all earlier items before all later
//! items, for the kinds of use in its masks.

use super::buffers::{Buf, Table};
use super::pass::{Grid, Work};
use super::{Page, Placement, name};
use crate::error::{Error, Result};
use crate::shaders::Access;
use std::collections::HashMap;

/// A kind of use of memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Use {
    /// Read by a shader, as storage or texels.
    ShaderRead,
    /// Written by a shader.
    ShaderWrite,
    /// Read as the arguments of an indirect dispatch.
    IndirectRead,
    /// Source of a copy.
    TransferRead,
    /// Destination of a copy or fill.
    TransferWrite,
}

impl Use {
    /// All kinds.
    pub const ALL: [Self; 5] =
        [Self::ShaderRead, Self::ShaderWrite, Self::IndirectRead, Self::TransferRead, Self::TransferWrite];

    /// True for writes.
    pub fn writes(self) -> bool {
        matches!(self, Self::ShaderWrite | Self::TransferWrite)
    }
}

/// A set of kinds of use.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Uses(u8);

impl Uses {
    /// The set of all kinds.
    pub const ALL: Self = Self(0b1_1111);

    /// Adds a kind.
    pub fn insert(&mut self, kind: Use) {
        self.0 |= 1 << kind as u8;
    }

    /// Returns true if the set contains the kind.
    pub fn contains(self, kind: Use) -> bool {
        self.0 & (1 << kind as u8) != 0
    }
}

/// A use of bytes of a buffer, before placement.
#[derive(Clone, Copy, Debug)]
pub(super) struct BufferUse {
    pub(super) buf: Buf,
    pub(super) kind: Use,
    /// Byte range in the buffer; `None` for the whole buffer.
    range: Option<(u64, u64)>,
}

/// An item's use of a range of memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Touch {
    /// The buffer.
    pub buf: Buf,
    /// Kind of use.
    pub kind: Use,
    /// The memory.
    pub page: Page,
    /// First byte.
    pub start: u64,
    /// First byte after the range.
    pub end: u64,
}

impl Touch {
    /// Returns true if the order matters: both share bytes, and at least one writes.
    pub fn conflicts(&self, other: &Self) -> bool {
        self.page == other.page
            && self.start < other.end
            && other.start < self.end
            && (self.kind.writes() || other.kind.writes())
    }
}

/// A global memory barrier before an item.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Barrier {
    /// Earlier uses that the barrier waits for.
    pub src: Uses,
    /// Later uses that wait for the barrier.
    pub dst: Uses,
    /// Hazards that need the barrier, as text.
    pub reason: String,
}

/// Lists an item's uses of buffers.
pub(super) fn uses(work: &Work, sizes: &[u64]) -> Vec<BufferUse> {
    let whole = |buf, kind| BufferUse { buf, kind, range: None };
    match work {
        Work::Fill { buf, .. } => vec![whole(*buf, Use::TransferWrite)],
        Work::Copy { from, to, bytes, .. } => {
            let most = sizes[from.index()].min(sizes[to.index()]);
            let range = Some((0, if *bytes == 0 { most } else { *bytes }));
            vec![
                BufferUse { buf: *from, kind: Use::TransferRead, range },
                BufferUse { buf: *to, kind: Use::TransferWrite, range },
            ]
        }
        Work::Pass(pass) => {
            let mut uses = Vec::new();
            if let Grid::Indirect(buf, offset) = pass.grid {
                let range = Some((u64::from(offset), u64::from(offset) + 12));
                uses.push(BufferUse { buf, kind: Use::IndirectRead, range });
            }
            for (binding, &buf) in pass.shader.bindings.iter().zip(&pass.buffers) {
                if binding.access != Access::Write {
                    uses.push(whole(buf, Use::ShaderRead));
                }
                if binding.access != Access::Read {
                    uses.push(whole(buf, Use::ShaderWrite));
                }
            }
            uses
        }
    }
}

/// Converts uses of buffers to uses of ranges of memory.
pub(super) fn touches(uses: &[BufferUse], placements: &[Option<Placement>]) -> Result<Vec<Touch>> {
    uses.iter()
        .map(|used| {
            let place = placements[used.buf.index()]
                .ok_or_else(|| Error::Bug(format!("buffer {} is used but not placed", used.buf.0)))?;
            let (start, end) = used.range.unwrap_or((0, place.bound));
            let (page, buf, kind) = (place.page, used.buf, used.kind);
            Ok(Touch { buf, kind, page, start: place.offset + start, end: place.offset + end })
        })
        .collect()
}

/// Derives as few barriers as possible, with at most one before each item.
///
/// Each barrier is placed as late as possible, directly before the item that needs it. Later hazards across it only
/// widen its masks, which is free because it is global.
pub(super) fn derive(
    table: &'static Table,
    labels: &[String],
    items: &[Vec<Touch>],
    everywhere: bool,
) -> Vec<Option<Barrier>> {
    let mut barriers: Vec<Option<Barrier>> = vec![None; items.len()];
    let mut past: HashMap<Page, Vec<(usize, Touch)>> = HashMap::new();
    let mut last_barrier = None;
    for (item, touches) in items.iter().enumerate() {
        let hazards = touches.iter().flat_map(|now| {
            let before = past.get(&now.page).map_or(&[][..], Vec::as_slice);
            before.iter().filter(|(_, then)| then.conflicts(now)).map(|(earlier, then)| (*earlier, *then, *now))
        });
        let mut reasons = Vec::new();
        let mut fresh = Barrier { src: Uses::default(), dst: Uses::default(), reason: String::new() };
        for (earlier, then, now) in hazards {
            let standing = last_barrier.filter(|&position| position > earlier);
            let barrier = match standing.and_then(|position: usize| barriers[position].as_mut()) {
                Some(standing) => standing,
                None => {
                    let reason = reason(table, &labels[item], &labels[earlier], &now, &then);
                    if !reasons.contains(&reason) {
                        reasons.push(reason);
                    }
                    &mut fresh
                }
            };
            barrier.src.insert(then.kind);
            barrier.dst.insert(now.kind);
        }
        if !reasons.is_empty() || (everywhere && item > 0) {
            if everywhere {
                (fresh.src, fresh.dst) = (Uses::ALL, Uses::ALL);
                reasons.push("barrier_everywhere puts a barrier before every item".to_owned());
            }
            fresh.reason = reasons.join("; ");
            barriers[item] = Some(fresh);
            last_barrier = Some(item);
        }
        for touch in touches {
            past.entry(touch.page).or_default().push((item, *touch));
        }
    }
    barriers
}

fn reason(table: &'static Table, now_by: &str, then_by: &str, now: &Touch, then: &Touch) -> String {
    let now_name = name(table, now.buf);
    let does = if now.kind.writes() { "writes" } else { "reads" };
    let did = if then.kind.writes() { "written" } else { "read" };
    if now.buf == then.buf {
        format!("{now_by} {does} {now_name} {did} by {then_by}")
    } else {
        let then_name = name(table, then.buf);
        format!("{now_by} {does} {now_name} in the bytes of {then_name} {did} by {then_by}")
    }
}
