//! Loads, stores and atomics of the lanes of a fragment, with all checks.

use super::subgroup::{Active, Subgroup, lanes};
use super::{Bound, Machine};
use crate::findings::{Invocation, Kind, located};
use crate::lane::Lane;
use crate::memory::POISON;
use crate::program::{Atomic, Place, Register, Source, Space};
use crate::races::{Conflict, How};
use crate::shared::SharedMemory;

impl Lane {
    /// The invocation, for messages.
    pub(super) fn name(&self) -> Invocation {
        Invocation { group: self.group, lane: self.number }
    }
}

/// Shared memory and the subgroup that runs.
type Parts<'a, const W: usize> = (&'a mut SharedMemory, &'a mut Subgroup<W>);

impl<const W: usize> Machine<'_, W> {
    /// Chooses lanes that do an atomic on a buffer before the others.
    pub(super) fn some_of(&mut self, mask: u64) -> u64 {
        if mask.count_ones() == 1 || self.below(4) > 0 {
            return mask;
        }
        let cut = self.below(W);
        let low = mask & ((1 << cut) - 1);
        match (low, self.below(2)) {
            (0, _) => mask,
            (low, 0) => low,
            (low, _) if mask & !low != 0 => mask & !low,
            _ => mask,
        }
    }

    /// Offsets of a place in all lanes.
    fn offsets(&self, subgroup: &Subgroup<W>, place: &Place) -> [u32; W] {
        match place.at {
            None => [place.plus; W],
            Some(at) => subgroup.get(self.constants, at).map(|at| at.saturating_add(place.plus)),
        }
    }

    pub(super) fn load(&mut self, parts: Parts<'_, W>, mask: u64, place: &Place, width: u32, pc: u32) -> [u32; W] {
        let (shared, subgroup) = parts;
        let offsets = self.offsets(subgroup, place);
        let mut value = [0; W];
        for lane in lanes(mask) {
            let (at, from) = (offsets[lane], &subgroup.lanes[lane]);
            value[lane] = match place.space {
                Space::Buffer(binding) => self.load_buffer(from, (binding, at, width), How::Read, pc),
                Space::Push => self.push.get(at as usize / 4).copied().unwrap_or_default(),
                Space::Shared => self.load_shared(shared, from, at, How::Read, pc),
                Space::Local(first) => {
                    // An index out of bounds was reported.
                    subgroup.registers.get(first as usize + at as usize).map_or(POISON, |register| register[lane])
                }
            };
        }
        value
    }

    pub(super) fn store(&mut self, parts: Parts<'_, W>, mask: u64, place: &Place, value: Source, width: u32, pc: u32) {
        let (shared, subgroup) = parts;
        let offsets = self.offsets(subgroup, place);
        let value = *subgroup.get(self.constants, value);
        for lane in lanes(mask) {
            let (at, value) = (offsets[lane], value[lane]);
            match place.space {
                Space::Buffer(binding) => {
                    self.store_buffer(&subgroup.lanes[lane], (binding, at, width), value, How::Write, pc);
                }
                Space::Shared => self.store_shared(shared, &subgroup.lanes[lane], at, value, How::Write, pc),
                Space::Local(first) => {
                    if at < self.program.pinned - first {
                        subgroup.registers[(first + at) as usize][lane] = value;
                    }
                }
                Space::Push => {}
            }
        }
    }

    pub(super) fn atomic(
        &mut self,
        parts: Parts<'_, W>,
        active: &Active<W>,
        (op, to, place, value, comparator): (Atomic, Register, &Place, Source, Source),
        pc: u32,
    ) {
        let (shared, subgroup) = parts;
        let offsets = self.offsets(subgroup, place);
        let [value, comparator] = [value, comparator].map(|source| *subgroup.get(self.constants, source));
        let mut old = [0; W];
        // Which lane comes first is not defined.
        let start = self.below(W);
        let later = active.mask >> start << start;
        for lane in lanes(later).chain(lanes(active.mask & !later)) {
            let at = offsets[lane];
            let how = match op {
                Atomic::Load => How::AtomicRead,
                Atomic::Exchange | Atomic::Store => How::Exchange,
                _ => How::Atomic,
            };
            let before = match place.space {
                Space::Buffer(binding) => {
                    self.hand_over(&mut subgroup.lanes[lane], binding, at);
                    self.load_buffer(&subgroup.lanes[lane], (binding, at, 4), how, pc)
                }
                _ => self.load_shared(shared, &subgroup.lanes[lane], at, how, pc),
            };
            old[lane] = before;
            let after = match op {
                Atomic::Binary(op) => op.one([before, value[lane]]),
                Atomic::CompareExchange if before != comparator[lane] => before,
                Atomic::Load => continue,
                _ => value[lane],
            };
            match place.space {
                Space::Buffer(binding) => self.put(binding, at, 4, after),
                _ => {
                    if shared.get(at).is_some() {
                        shared.set(at, after);
                    }
                }
            }
        }
        subgroup.set(to, old, active);
    }

    /// One component of a texel in each lane.
    pub(super) fn fetch(
        &mut self,
        subgroup: &Subgroup<W>,
        mask: u64,
        binding: u16,
        (index, component): (Source, u32),
        pc: u32,
    ) -> [u32; W] {
        let index = subgroup.get(self.constants, index);
        let mut value = [0; W];
        let Some(format) = self.bound[usize::from(binding)].texels else { return value };
        for lane in lanes(mask) {
            value[lane] = match component {
                component if component < format.words => {
                    let at = index[lane].saturating_mul(4 * format.words).saturating_add(4 * component);
                    self.load_buffer(&subgroup.lanes[lane], (binding, at, 4), How::Read, pc)
                }
                3 if format.is_float => 1.0_f32.to_bits(),
                3 => 1,
                _ => 0,
            };
        }
        value
    }

    fn hand_over(&mut self, lane: &mut Lane, binding: u16, at: u32) {
        let Bound { memory, offset, .. } = self.bound[usize::from(binding)];
        self.races.hand_over((memory, offset + u64::from(at)), lane);
    }

    /// Checks an access of a buffer. Returns the memory and byte, if they are there.
    fn check(&mut self, lane: &Lane, (binding, at, width): (u16, u32, u32), how: How, pc: u32) -> Option<(usize, u64)> {
        let program = self.program;
        let number = program.bindings[usize::from(binding)].number;
        let Bound { memory, offset, bytes, .. } = self.bound[usize::from(binding)];
        if u64::from(at) + u64::from(width) > bytes || !at.is_multiple_of(width) {
            let name = lane.name();
            self.found(Kind::Bounds, pc, u64::from(binding), || {
                format!("{name} accesses byte {at} of {bytes} of binding {number}")
            });
            return None;
        }
        let byte = offset + u64::from(at);
        let found = self.memories[memory].as_mut()?;
        if !self.is_tracked[usize::from(binding)] {
            return Some((memory, byte));
        }
        let granule = program.granule;
        for part in 0..width / granule {
            let unit = byte / u64::from(granule) + u64::from(part);
            let how = (how, how.is_atomic() || program.bindings[usize::from(binding)].is_coherent);
            let found = self.races.access((memory, unit), found.shadow(unit), lane, how, pc);
            let Some((other, conflict)) = found else { continue };
            let name = lane.name();
            let kind = match conflict {
                Conflict::Unordered => Kind::BufferRace,
                Conflict::Incoherent => Kind::Coherence,
            };
            self.findings.add(program, kind, pc, u64::from(binding), || {
                let there = located(program, program.origins[other.pc as usize]);
                let other = Invocation { group: other.group, lane: other.lane };
                format!("{name} and {other} (at {there}) access byte {at} of binding {number}")
            });
        }
        Some((memory, byte))
    }

    fn load_buffer(&mut self, lane: &Lane, place: (u16, u32, u32), how: How, pc: u32) -> u32 {
        let Some((memory, byte)) = self.check(lane, place, how, pc) else { return 0 };
        let (binding, at, width) = place;
        let Some(found) = self.memories[memory].as_ref() else { return 0 };
        let value = found.read(byte, width);
        // What an exchange returns may be unused.
        if found.is_written(byte) || how == How::Exchange {
            return value;
        }
        let (name, number) = (lane.name(), self.program.bindings[usize::from(binding)].number);
        self.found(Kind::Stale, pc, u64::from(binding), || format!("{name} reads byte {at} of binding {number}"));
        POISON
    }

    fn store_buffer(&mut self, lane: &Lane, place: (u16, u32, u32), value: u32, how: How, pc: u32) {
        if self.check(lane, place, how, pc).is_some() {
            self.put(place.0, place.1, place.2, value);
        }
    }

    /// Writes without a check.
    fn put(&mut self, binding: u16, at: u32, width: u32, value: u32) {
        let Bound { memory, offset, bytes, .. } = self.bound[usize::from(binding)];
        if let Some(found) = self.memories[memory].as_mut().filter(|_| u64::from(at) + u64::from(width) <= bytes) {
            found.write(offset + u64::from(at), width, value);
        }
    }

    fn load_shared(&mut self, shared: &mut SharedMemory, lane: &Lane, at: u32, how: How, pc: u32) -> u32 {
        let Some(value) = self.check_shared(shared, lane, at, how, pc) else { return POISON };
        if !shared.is_written(at) && how != How::Exchange {
            let name = lane.name();
            self.found(Kind::Unwritten, pc, u64::MAX, || format!("{name} reads word {at} of shared memory"));
        }
        value
    }

    fn store_shared(&mut self, shared: &mut SharedMemory, lane: &Lane, at: u32, value: u32, how: How, pc: u32) {
        if self.check_shared(shared, lane, at, how, pc).is_some() {
            shared.set(at, value);
        }
    }

    fn check_shared(&mut self, shared: &mut SharedMemory, lane: &Lane, at: u32, how: How, pc: u32) -> Option<u32> {
        let (program, name) = (self.program, lane.name());
        let Some(value) = shared.get(at) else {
            let words = program.shared_words;
            self.found(Kind::Bounds, pc, u64::MAX, || format!("{name} accesses word {at} of {words} of shared memory"));
            return None;
        };
        if let Some(other) = shared.access(at, lane, how, pc) {
            self.found(Kind::SharedRace, pc, u64::MAX, || {
                let there = located(program, program.origins[other.pc as usize]);
                let other = Invocation { group: lane.group, lane: other.lane };
                format!("{name} and {other} (at {there}) access word {at} of shared memory")
            });
        }
        Some(value)
    }
}
