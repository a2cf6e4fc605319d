//! Lets buffers share bindings, on devices with too few storage bindings.
//!
//! All buffers outside of scratch lie in one block per memory kind (several if they exceed the largest allocation). A
//! pass binds windows: ranges of blocks and scratch pages that contain its buffers. `gpu/packed.rs` rewrites the
//! kernels accordingly.

use super::buffers::{Class, Table};
use super::pass::{PassDecl, PassList, Work};
use super::{Limits, Page, Placement, PlanOptions, memory};
use crate::error::{Error, Result};
use crate::gpu::MemoryKind;
use crate::shaders::BindingKind;

/// Placement of the buffers outside of scratch.
pub(crate) struct Layout {
    /// Kind and bytes of each block.
    pub(crate) blocks: Vec<(MemoryKind, u64)>,
    /// Block and first byte of each copy, by row of the table; empty for scratch and for buffers without elements.
    pub(crate) places: Vec<Vec<(usize, u64)>>,
}

impl Layout {
    /// Lays out the buffers: host-written buffers by frame, then the others in table order.
    pub(crate) fn new(table: &'static Table, counts: &[u64], options: PlanOptions, limits: &Limits) -> Result<Self> {
        let mut layout = Self { blocks: Vec::new(), places: vec![Vec::new(); table.len()] };
        let mut sizes = vec![0; table.len()];
        for (index, decl) in table.iter().enumerate().filter(|(_, decl)| decl.class != Class::Step) {
            sizes[index] = memory::own_bytes(decl, counts, options, limits.alignment())?;
            let copies = if sizes[index] == 0 { 0 } else { decl.class.copies(limits) };
            layout.places[index] = vec![(0, 0); copies];
        }
        let most = layout.places.iter().map(Vec::len).max().unwrap_or(0);
        for kind in [MemoryKind::Device, MemoryKind::Upload, MemoryKind::Download] {
            let mut bytes = 0;
            // The first copies come last and are followed by the buffers with one copy, so that buffers of a frame are
            // adjacent.
            for copy in (1..most).chain([0]) {
                for (index, decl) in table.iter().enumerate() {
                    if copy >= layout.places[index].len() || memory::kind(decl.class, copy, limits) != kind {
                        continue;
                    }
                    if bytes > 0 && bytes + sizes[index] > limits.max_allocation {
                        layout.blocks.push((kind, std::mem::take(&mut bytes)));
                    }
                    layout.places[index][copy] = (layout.blocks.len(), bytes);
                    bytes += sizes[index];
                }
            }
            if bytes > 0 {
                layout.blocks.push((kind, bytes));
            }
        }
        Ok(layout)
    }
}

/// A byte range of a block or page.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Span<K> {
    pub(crate) of: K,
    pub(crate) start: u64,
    pub(crate) end: u64,
}

/// Windows that contain all buffers of a pass.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Cover<K> {
    pub(crate) windows: Vec<Span<K>>,
    /// Window of each buffer.
    pub(crate) window_of: Vec<u8>,
}

/// Covers buffers with the fewest windows. Windows are ordered by the first buffer that uses their block, so that
/// passes with the same placement share kernels.
pub(crate) fn cover<K: Copy + PartialEq>(buffers: &[Span<K>], limits: &Limits) -> Cover<K> {
    let mut blocks: Vec<K> = Vec::new();
    for buffer in buffers {
        if !blocks.contains(&buffer.of) {
            blocks.push(buffer.of);
        }
    }
    let mut cover = Cover { windows: Vec::new(), window_of: vec![0; buffers.len()] };
    for block in blocks {
        let mut own: Vec<usize> = (0..buffers.len()).filter(|&index| buffers[index].of == block).collect();
        own.sort_by_key(|&index| buffers[index].start);
        let first = cover.windows.len();
        for index in own {
            let Span { of, start, end } = buffers[index];
            // Round up to whole elements, including padded structs.
            let end = end.next_multiple_of(limits.alignment());
            match cover.windows[first..].last_mut() {
                Some(window) if end.max(window.end) - window.start <= limits.max_storage_range => {
                    window.end = window.end.max(end);
                }
                _ => cover.windows.push(Span { of, start, end }),
            }
            cover.window_of[index] = (cover.windows.len() - 1) as u8;
        }
    }
    cover
}

/// Fails if a pass of a list needs more windows than the device can bind.
pub(super) fn check(
    table: &'static Table,
    counts: &[u64],
    list: &PassList,
    placements: &[Option<Placement>],
    (limits, options): (&Limits, PlanOptions),
) -> Result<()> {
    let layout = Layout::new(table, counts, options, limits)?;
    for work in &list.work {
        let Work::Pass(pass) = work else { continue };
        for frame in 0..limits.frames {
            let buffers = spans(table, pass, placements, (&layout, frame));
            let needed = cover(&buffers, limits).windows.len() as u64;
            if needed > u64::from(limits.windows) {
                let windows = limits.windows;
                return Err(Error::OutOfMemory {
                    what: format!("the set of buffers of {}", pass.label),
                    needed: needed * limits.max_storage_range,
                    limit_name: format!("what the {windows} storage bindings of this device hold"),
                    limit: u64::from(windows) * limits.max_storage_range,
                    cure: (table.cure)(),
                });
            }
        }
    }
    Ok(())
}

fn spans(
    table: &'static Table,
    pass: &PassDecl,
    placements: &[Option<Placement>],
    (layout, frame): (&Layout, usize),
) -> Vec<Span<(bool, usize)>> {
    let storage = pass.shader.bindings.iter().zip(&pass.buffers).filter(|(desc, _)| desc.kind == BindingKind::Storage);
    let span = |buf: usize| {
        let place = placements.get(buf).copied().flatten()?;
        let (of, start) = match place.page {
            Page::Step(page) => ((true, page as usize), place.offset),
            Page::Own(_) => {
                let copy = if table[buf].class.is_shared() { frame } else { 0 };
                let (block, start) = layout.places[buf].get(copy).copied()?;
                ((false, block), start)
            }
        };
        Some(Span { of, start, end: start + place.bound })
    };
    storage.filter_map(|(_, buf)| span(buf.index())).collect()
}

#[cfg(test)]
mod tests {
    use super::{Cover, Limits, Span, cover};

    const K: u64 = 1024;

    fn limits(range: u64) -> Limits {
        Limits { max_storage_range: range, max_storage_buffers: 4, ..Limits::default() }.packed()
    }

    fn span(of: char, start: u64, end: u64) -> Span<char> {
        Span { of, start: start * K, end: end * K }
    }

    #[test]
    fn a_window_for_each_block_holds_its_buffers() {
        let buffers = [span('b', 4, 5), span('a', 2, 3), span('b', 0, 1), span('a', 7, 9)];
        let found = cover(&buffers, &limits(64 * K));
        assert_eq!(found, Cover { windows: vec![span('b', 0, 5), span('a', 2, 9)], window_of: vec![0, 1, 0, 1] });
    }

    #[test]
    fn no_window_exceeds_the_largest_binding() {
        let buffers = [span('a', 0, 4), span('a', 4, 8), span('a', 6, 10), span('a', 0, 2)];
        let found = cover(&buffers, &limits(8 * K));
        assert_eq!(found, Cover { windows: vec![span('a', 0, 8), span('a', 6, 10)], window_of: vec![0, 0, 1, 0] });
    }

    #[test]
    fn a_window_ends_with_a_whole_element() {
        let found = cover(&[Span { of: 'a', start: 0, end: 104 }], &limits(8 * K));
        assert_eq!(found.windows, [Span { of: 'a', start: 0, end: 512 }]);
    }
}
