//! Places buffers: Step buffers share pages by first fit, all others have their own memory.

use super::Limits;
use super::buffers::{Buf, BufferDecl, Class, Table};
use super::lifetime::Lifetime;
use super::{GUARD_BYTES, Page, Placement, PlanOptions};
use crate::error::{Error, Result};

struct PlacedBuffer {
    page: usize,
    start: u64,
    end: u64,
    life: Lifetime,
}

/// Places every buffer outside of scratch, and the scratch buffers of the list; returns the sizes of the Step pages.
///
/// Places larger buffers first, ties by name: first fit then wastes little space, and the result does not depend on the
/// table order.
pub(super) fn place(
    table: &'static Table,
    sizes: &[u64],
    lives: &[Option<Lifetime>],
    limits: &Limits,
    options: PlanOptions,
) -> Result<(Vec<Option<Placement>>, Vec<u64>)> {
    let mut placements = vec![None; table.len()];
    let mut scratch = Vec::new();
    for (index, decl) in table.iter().enumerate() {
        let bytes = sizes[index];
        let bound = bytes + if options.guards { GUARD_BYTES } else { 0 };
        if decl.class != Class::Step {
            check_allocation(decl, bound, limits)?;
            placements[index] = Some(Placement { page: Page::Own(Buf(index as u16)), offset: 0, bytes, bound });
        } else if let Some(life) = lives[index] {
            check_allocation(decl, bound, limits)?;
            let life = if options.aliases() { life } else { Lifetime { first: 0, last: usize::MAX } };
            scratch.push((index, bytes, bound, life));
        }
    }
    scratch.sort_by(|a, b| b.2.cmp(&a.2).then_with(|| table[a.0].name.cmp(table[b.0].name)));
    let mut placed: Vec<PlacedBuffer> = Vec::new();
    let mut pages: Vec<u64> = Vec::new();
    for (index, bytes, bound, life) in scratch {
        let (page, start) = first_fit(&placed, pages.len(), bound, life, limits);
        if page == pages.len() {
            pages.push(0);
        }
        pages[page] = pages[page].max((start + bound).next_multiple_of(limits.alignment()));
        placed.push(PlacedBuffer { page, start, end: start + bound, life });
        placements[index] = Some(Placement { page: Page::Step(page as u32), offset: start, bytes, bound });
    }
    Ok((placements, pages))
}

/// Returns the lowest offset in the first page with room, or the start of a new page.
fn first_fit(placed: &[PlacedBuffer], pages: usize, bytes: u64, life: Lifetime, limits: &Limits) -> (usize, u64) {
    for page in 0..pages {
        let mut taken = placed
            .iter()
            .filter(|other| other.page == page && other.life.overlaps(life))
            .map(|other| (other.start, other.end))
            .collect::<Vec<_>>();
        taken.sort_unstable();
        let mut start = 0_u64;
        for (other_start, other_end) in taken {
            if start + bytes <= other_start {
                break;
            }
            start = start.max(other_end.next_multiple_of(limits.alignment()));
        }
        if (start + bytes).next_multiple_of(limits.alignment()) <= limits.max_allocation {
            return (page, start);
        }
    }
    (pages, 0)
}

fn check_allocation(decl: &BufferDecl, bytes: u64, limits: &Limits) -> Result<()> {
    // A buffer's page is rounded up to the alignment.
    let needed = bytes.next_multiple_of(limits.alignment());
    if needed <= limits.max_allocation {
        return Ok(());
    }
    let fits = (limits.max_allocation / limits.alignment() * limits.alignment()) / u64::from(decl.element_bytes);
    Err(Error::OutOfMemory {
        what: decl.name.to_owned(),
        needed,
        limit_name: "the largest allocation of this device".to_owned(),
        limit: limits.max_allocation,
        cure: (decl.domain.cure)(fits),
    })
}
