//! Gaussians of a plane copied into its hole, from places whole periods of the plane's pattern away.
//!
//! Patches are filled from the rim of the hole inwards, those first that continue an edge from much that is known
//! (priority = confidence x data term, Criminisi, Perez and Toyama, TIP 2004). Sources are a number of periods away
//! (dominant offsets, He and Sun, ECCV 2012): the one whose colours are most like those already in the patch.

use super::evidence::on_surface;
use super::pattern::Pattern;
use super::shadow::Shadows;
use super::sheet::{STEPS_BESIDE, Sheet, means};
use glam::{DVec2, DVec3};
use labelgs_scene::Gaussians;
use labelgs_scene::harmonics::{sh0_of, value_of};

/// Half of the side of a patch, in cells.
const PATCH_RADIUS_CELLS: isize = 4;
/// What is added to the data term, as a share of a step from black to white between two cells: flat patches are filled
/// too.
const DATA_OFFSET: f64 = 0.01;
/// Distance within which colours change too fast to be those of the new place, in cells.
const DETAIL_CELLS: usize = 8;

/// Where each cell of a hole has its Gaussians from.
pub(super) struct Sources<'a> {
    sheet: &'a Sheet,
    /// Offsets in cells to the sources.
    offsets: Vec<DVec2>,
    /// The offset of each cell of a hole that has one.
    chosen: Vec<Option<usize>>,
    /// The offsets that some cell has.
    used: Vec<usize>,
    pattern: &'a Pattern<'a>,
}

/// The hole that copies are moved into, and the shadows on the plane that the sources are chosen on.
pub(super) struct Target<'a> {
    pub sheet: &'a Sheet,
    pub holes: &'a [usize],
    pub shadows: Option<&'a Shadows>,
}

/// A copy: its place, and the cells that it comes from and goes to.
struct Move {
    place: DVec3,
    from: usize,
    to: usize,
}

/// A hole that is filled patch by patch.
struct Growth<'a> {
    sheet: &'a Sheet,
    pattern: &'a Pattern<'a>,
    offsets: Vec<DVec2>,
    colours: Vec<Option<DVec3>>,
    confidence: Vec<f64>,
    is_open: Vec<bool>,
    chosen: Vec<Option<usize>>,
}

impl Growth<'_> {
    /// Returns the cells of the patch around a cell.
    fn patch(&self, index: usize) -> impl Iterator<Item = usize> {
        let steps = (-PATCH_RADIUS_CELLS..=PATCH_RADIUS_CELLS)
            .flat_map(|dy| (-PATCH_RADIUS_CELLS..=PATCH_RADIUS_CELLS).map(move |dx| [dx, dy]));
        steps.filter_map(move |step| self.sheet.step(index, step))
    }

    /// Returns true for an open cell beside one that is known.
    fn is_front(&self, index: usize) -> bool {
        let is_known = |step: &[isize; 2]| self.sheet.step(index, *step).is_some_and(|at| self.colours[at].is_some());
        self.is_open[index] && STEPS_BESIDE.iter().any(is_known)
    }

    fn trust(&self, index: usize) -> f64 {
        let (sum, count) = self.patch(index).fold((0.0, 0.0), |(sum, n), at| (sum + self.confidence[at], n + 1.0));
        sum / count
    }

    /// Returns the confidence times the strongest edge that runs into the hole at a cell of its front.
    fn priority(&self, index: usize) -> f64 {
        let grey = |at: usize| self.colours[at].map(|colour| colour.element_sum() / 3.0);
        let beside = |step: [isize; 2]| self.sheet.step(index, step);
        // Along the front, whose normal points to what is open.
        let open = |step: [isize; 2]| f64::from(u8::from(beside(step).is_some_and(|at| self.is_open[at])));
        let normal = DVec2::new(open([1, 0]) - open([-1, 0]), open([0, 1]) - open([0, -1])).normalize_or_zero();
        let change = |at: usize, step: [isize; 2]| {
            let ends = [self.sheet.step(at, step), self.sheet.step(at, step.map(|step| -step))];
            let [after, before] = ends.map(|at| at.and_then(grey));
            Some(0.5 * (after? - before?))
        };
        let edge = |at: usize| Some(DVec2::new(change(at, [1, 0])?, change(at, [0, 1])?).perp());
        let strongest = self.patch(index).filter_map(edge).map(|edge| edge.dot(normal).abs()).fold(0.0, f64::max);
        self.trust(index) * (strongest + DATA_OFFSET)
    }

    /// Returns the offset whose colours are most like what is known of a patch, of those that are seen in all the rest
    /// of it.
    fn best(&self, index: usize) -> Option<usize> {
        let patch: Vec<usize> = self.patch(index).collect();
        let apart = |offset: DVec2| {
            let (mut sum, mut count) = (0.0, 0.0);
            for &at in &patch {
                let there = self.pattern.seen_at(at, offset);
                match (self.colours[at], there) {
                    (Some(here), Some(there)) => {
                        sum += (there - here).length_squared();
                        count += 1.0;
                    }
                    (None, None) if self.is_open[at] => return None,
                    _ => {}
                }
            }
            (count > 0.0).then(|| sum / count)
        };
        let scored = self.offsets.iter().enumerate().filter_map(|(which, &offset)| Some((apart(offset)?, which)));
        scored.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))).map(|(_, which)| which)
    }

    /// Fills the open cells of a patch.
    fn fill(&mut self, index: usize, which: usize) {
        let trust = self.trust(index);
        for at in self.patch(index).collect::<Vec<_>>() {
            if self.is_open[at] {
                self.is_open[at] = false;
                self.colours[at] = self.pattern.seen_at(at, self.offsets[which]);
                self.confidence[at] = trust;
                self.chosen[at] = Some(which);
            }
        }
    }
}

impl<'a> Sources<'a> {
    /// Chooses the sources of the holes of a sheet by its pattern.
    pub(super) fn of(sheet: &'a Sheet, pattern: &'a Pattern<'a>) -> Self {
        let colours = pattern.colours().to_vec();
        let confidence = colours.iter().map(|colour| f64::from(u8::from(colour.is_some()))).collect();
        let mut is_open: Vec<bool> = vec![false; colours.len()];
        sheet.holes().into_iter().for_each(|index| is_open[index] = true);
        // What is not trusted around a hole is filled on the way.
        let cells = is_open.len();
        let offsets: Vec<DVec2> = pattern.offsets().collect();
        let mut growth = Growth { sheet, pattern, offsets, colours, confidence, is_open, chosen: vec![None; cells] };
        for index in 0..cells {
            growth.is_open[index] |= growth.colours[index].is_none() && sheet.is_seen(index);
        }
        loop {
            let front = (0..cells).filter(|&index| growth.is_front(index));
            let next = front.map(|index| (growth.priority(index), index));
            let Some((_, index)) = next.max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1))) else { break };
            match growth.best(index) {
                Some(which) => growth.fill(index, which),
                // Nothing is seen at all its sources: its place stays as it is.
                None => growth.is_open[index] = false,
            }
        }
        let Growth { offsets, chosen, .. } = growth;
        let used = (0..offsets.len()).filter(|which| chosen.contains(&Some(*which))).collect();
        Self { sheet, offsets, chosen, used, pattern }
    }

    /// Returns copies of those of the first `rows` Gaussians of `model` that lie on the plane and have their new place
    /// in the hole. What changes slowly in their colours is that of the new place, light too.
    pub(super) fn copies(&self, model: &Gaussians, rows: usize, target: &Target) -> Gaussians {
        let (mut picked, mut moved) = (Vec::new(), Vec::new());
        let mut is_hole = vec![false; target.sheet.width * target.sheet.height];
        target.holes.iter().for_each(|&index| is_hole[index] = true);
        for row in (0..rows).filter(|&row| model.label(row) == self.sheet.label && model.is_finite(row)) {
            let world = model.world(row);
            let is_on = self.sheet.plane.height(world).abs() <= on_surface(self.sheet.cell);
            let Some(from) = self.sheet.index(world).filter(|_| is_on) else { continue };
            for (place, to) in self.places(world) {
                if target.sheet.index(place).is_some_and(|index| is_hole[index]) {
                    picked.push(row);
                    moved.push(Move { place, from, to });
                }
            }
        }
        let mut copies = model.picked(&picked);
        self.colour(&mut copies, &moved, target.shadows);
        copies
    }

    /// Returns the places of copies of what is at a place of the plane, and their cells.
    fn places(&self, world: DVec3) -> impl Iterator<Item = (DVec3, usize)> {
        let Sheet { plane, cell, .. } = self.sheet;
        let moved = move |&which: &usize| {
            let place = world - *cell * (self.offsets[which].x * plane.u + self.offsets[which].y * plane.v);
            let to = self.sheet.index(place)?;
            (self.chosen[to] == Some(which)).then_some((place, to))
        };
        self.used.iter().filter_map(moved)
    }

    /// Moves copies and gives them the slow changes of the colours there.
    fn colour(&self, copies: &mut Gaussians, moved: &[Move], shadows: Option<&Shadows>) {
        let Some(lit) = self.sheet.continued(shadows, Some(self.pattern)) else { return };
        let lit: Vec<Option<DVec3>> = lit.into_iter().map(Some).collect();
        let slow = means(self.sheet, &lit, DETAIL_CELLS);
        let after = |index: usize| shadows.map_or(DVec3::ONE, |shadows| shadows.after(index));
        for (row, &Move { place, from, to }) in moved.iter().enumerate() {
            copies.means[row] = (place - copies.origin).as_vec3().to_array();
            let step = slow[to].unwrap_or_default() - slow[from].unwrap_or_default();
            for channel in 0..3 {
                let (old, new) = (after(from)[channel], after(to)[channel]);
                let sh0 = &mut copies.sh0[row][channel];
                *sh0 = sh0_of((value_of(*sh0) / old + step[channel]) * new);
                copies.rest_mut(row).iter_mut().for_each(|band| band[channel] *= (new / old) as f32);
            }
        }
    }
}
