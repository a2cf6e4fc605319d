//! Checks a plan by brute force, from the rules of Vulkan and independent of the planner.

use super::*;
use labelgs::scheduler::plan::{Class, Use};
use rand::rngs::SmallRng;
use rand::{Rng, SeedableRng};

pub fn all_options() -> Vec<PlanOptions> {
    let flags = [false, true];
    let pairs = flags.into_iter().flat_map(|alias| flags.map(|guards| (alias, guards)));
    let all = pairs
        .flat_map(|(alias, guards)| flags.map(|barrier_everywhere| PlanOptions { alias, guards, barrier_everywhere }));
    all.collect()
}

/// Items that use a buffer.
fn users(list: &PassList, buf: Buf) -> Vec<usize> {
    let uses = |work: &Work| match work {
        Work::Fill { buf: filled, .. } => *filled == buf,
        Work::Copy { from, to, .. } => [*from, *to].contains(&buf),
        Work::Pass(pass) => {
            pass.buffers.contains(&buf) || matches!(pass.grid, Grid::Indirect(arguments, _) if arguments == buf)
        }
    };
    (0..list.work.len()).filter(|&item| uses(&list.work[item])).collect()
}

/// Checks that buffers alive at once share no bytes, and that all places are aligned and inside their pages.
pub fn check_places(plan: &Plan, limits: &Limits) {
    let mut scratch = Vec::new();
    for (index, decl) in plan.table.iter().enumerate() {
        let buf = Buf(index as u16);
        let users = users(&plan.list, buf);
        let Some(place) = plan.placements[index] else {
            assert!(decl.class == Class::Step && users.is_empty(), "{} has no place", decl.name);
            continue;
        };
        let elements = decl.count(&plan.counts).unwrap().max(1);
        assert_eq!(place.bytes, elements * u64::from(decl.element_bytes), "{}", decl.name);
        match place.page {
            Page::Own(own) => assert!(own == buf && place.offset == 0 && decl.class != Class::Step, "{}", decl.name),
            Page::Step(page) => {
                assert_eq!(decl.class, Class::Step, "{}", decl.name);
                assert_eq!(place.offset % limits.storage_alignment.max(limits.texel_alignment), 0, "{}", decl.name);
                let end = place.offset + place.bytes + if plan.options.guards { 256 } else { 0 };
                assert!(end <= plan.step_pages[page as usize], "{} ends behind its page", decl.name);
                scratch.push((decl.name, page, place.offset..end, users[0]..=users[users.len() - 1]));
            }
        }
    }
    assert!(plan.step_pages.iter().all(|&bytes| bytes <= limits.max_allocation));
    for (position, one) in scratch.iter().enumerate() {
        for other in &scratch[position + 1..] {
            let same_bytes = one.1 == other.1 && one.2.start < other.2.end && other.2.start < one.2.end;
            let same_time = one.3.start() <= other.3.end() && other.3.start() <= one.3.end();
            let may_share = plan.options.alias && !plan.options.guards;
            assert!(!same_bytes || (may_share && !same_time), "{} and {} share bytes", one.0, other.0);
        }
    }
}

/// Accesses of an item: page, first byte, byte after the last, kind.
fn accesses(plan: &Plan, item: usize) -> Vec<(Page, u64, u64, Use)> {
    let mut accesses = Vec::new();
    let mut add = |buf: Buf, kind: Use, range: Option<(u64, u64)>| {
        let place = plan.placements[buf.0 as usize].unwrap();
        let (start, end) = range.unwrap_or((0, place.bytes));
        accesses.push((place.page, place.offset + start, place.offset + end, kind));
    };
    match &plan.list.work[item] {
        Work::Fill { buf, .. } => add(*buf, Use::TransferWrite, None),
        Work::Copy { from, to, bytes, .. } => {
            let all = [from, to].map(|buf| plan.placements[buf.0 as usize].unwrap().bytes);
            let bytes = if *bytes == 0 { all[0].min(all[1]) } else { *bytes };
            add(*from, Use::TransferRead, Some((0, bytes)));
            add(*to, Use::TransferWrite, Some((0, bytes)));
        }
        Work::Pass(pass) => {
            if let Grid::Indirect(buf, offset) = pass.grid {
                add(buf, Use::IndirectRead, Some((u64::from(offset), u64::from(offset) + 12)));
            }
            for (binding, buf) in pass.shader.bindings.iter().zip(&pass.buffers) {
                match binding.access {
                    Access::Read => add(*buf, Use::ShaderRead, None),
                    Access::Write => add(*buf, Use::ShaderWrite, None),
                    Access::ReadWrite => {
                        add(*buf, Use::ShaderRead, None);
                        add(*buf, Use::ShaderWrite, None);
                    }
                }
            }
        }
    }
    accesses
}

/// The first two items that touch the same bytes, one of them writing, without a barrier between them that waits for
/// the first kind of use and holds back the second.
pub fn first_race(plan: &Plan) -> Option<(usize, usize)> {
    let writes = |kind: Use| matches!(kind, Use::ShaderWrite | Use::TransferWrite);
    let accesses = (0..plan.items.len()).map(|item| accesses(plan, item)).collect::<Vec<_>>();
    for later in 0..accesses.len() {
        for earlier in 0..later {
            for then in &accesses[earlier] {
                for now in &accesses[later] {
                    let overlap = then.0 == now.0 && then.1 < now.2 && now.1 < then.2;
                    if !overlap || !(writes(then.3) || writes(now.3)) {
                        continue;
                    }
                    let between = plan.items[earlier + 1..=later].iter().filter_map(|item| item.barrier.as_ref());
                    if !between.into_iter().any(|one| one.src.contains(then.3) && one.dst.contains(now.3)) {
                        return Some((earlier, later));
                    }
                }
            }
        }
    }
    None
}

/// Makes random pass lists that read no scratch before it is written.
pub struct Random(SmallRng);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(SmallRng::seed_from_u64(seed))
    }

    pub fn list(&mut self) -> PassList {
        let mut list = PassList::new("random");
        let mut written = vec![MODEL, LABELS, TOTALS, UNIFORMS, REPORT];
        for _ in 0..self.0.random_range(1..30) {
            let to = Buf(self.0.random_range(0..table::TABLE.len() as u16));
            match self.0.random_range(0..8) {
                0 => {
                    list.fill(to, 1);
                }
                1 => {
                    let from = written[self.0.random_range(0..written.len())];
                    if from == to {
                        continue;
                    }
                    list.copy(from, to, self.0.random_range(0..2) * 4);
                }
                _ => {
                    let pass = self.pass(&written, to);
                    list.pass(pass);
                }
            }
            if !written.contains(&to) {
                written.push(to);
            }
        }
        list
    }

    fn pass(&mut self, written: &[Buf], to: Buf) -> PassDecl {
        let mut buffers = Vec::new();
        for _ in 0..self.0.random_range(0..4) {
            let buf = written[self.0.random_range(0..written.len())];
            let access = if self.0.random_ratio(1, 4) { Access::ReadWrite } else { Access::Read };
            buffers.push((buf, access));
        }
        buffers.push((to, if self.0.random_ratio(1, 3) { Access::ReadWrite } else { Access::Write }));
        let indirect = written.contains(&C) && self.0.random_bool(0.4);
        let offset = self.0.random_range(0..20) * 4;
        pass("random", &buffers, if indirect { Grid::Indirect(C, offset) } else { Grid::Groups(1, 1, 1) })
    }
}
