//! Hazards on byte ranges, and the barriers that remove them.
//!
//! Ranges are compared, not buffers, so the reuse of bytes by aliasing needs no rule of its own: it is a write after a
//! read, like any other. All barriers are global memory barriers: one before an item orders everything before it
//! against everything after it, for the kinds of use in its masks.

use super::buffers::{Buf, BufferDecl};
use super::memory::Size;
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
    /// Every kind.
    pub const ALL: Self = Self(0b1_1111);

    /// Adds a kind.
    pub fn insert(&mut self, kind: Use) {
        self.0 |= 1 << kind as u8;
    }

    /// True if it holds the kind.
    pub fn contains(self, kind: Use) -> bool {
        self.0 & (1 << kind as u8) != 0
    }
}

/// A use of some bytes of a buffer, before it has a place.
#[derive(Clone, Copy, Debug)]
pub(super) struct BufferUse {
    pub(super) buf: Buf,
    pub(super) kind: Use,
    /// Byte range in the buffer; none for all of it.
    range: Option<(u64, u64)>,
}

/// A use of a range of memory by an item.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Touch {
    /// The buffer.
    pub buf: Buf,
    /// What is done.
    pub kind: Use,
    /// The memory.
    pub page: Page,
    /// First byte.
    pub start: u64,
    /// Byte after the last.
    pub end: u64,
}

impl Touch {
    /// True if the two must not be reordered: they share bytes and one of them writes.
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
    /// Uses before it that it waits for.
    pub src: Uses,
    /// Uses after it that wait.
    pub dst: Uses,
    /// Why it is there.
    pub reason: String,
}

/// What an item does with buffers.
pub(super) fn uses(work: &Work, sizes: &[Size]) -> Vec<BufferUse> {
    let whole = |buf, kind| BufferUse { buf, kind, range: None };
    match work {
        Work::Fill { buf, .. } => vec![whole(*buf, Use::TransferWrite)],
        Work::Copy { from, to, bytes, .. } => {
            let most = sizes[from.index()].bytes.min(sizes[to.index()].bytes);
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

/// The same uses as ranges of memory.
pub(super) fn touches(uses: &[BufferUse], placements: &[Option<Placement>]) -> Result<Vec<Touch>> {
    uses.iter()
        .map(|used| {
            let place = placements[used.buf.index()]
                .ok_or_else(|| Error::Bug(format!("buffer {} is used and has no place", used.buf.0)))?;
            let (start, end) = used.range.unwrap_or((0, place.bound));
            let (page, buf, kind) = (place.page, used.buf, used.kind);
            Ok(Touch { buf, kind, page, start: place.offset + start, end: place.offset + end })
        })
        .collect()
}

/// At most one barrier before each item, as few as possible.
///
/// A barrier is put as late as possible, just before the item that needs it; every later hazard across it is then
/// covered by widening its masks, which costs nothing as it is global anyway.
pub(super) fn derive(
    table: &'static [BufferDecl],
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
                reasons.push("a barrier before every item was asked for".to_owned());
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

fn reason(table: &'static [BufferDecl], now_by: &str, then_by: &str, now: &Touch, then: &Touch) -> String {
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
