//! A plane as a grid of cells: what the views show of each, and the colour of those that none shows.

use super::evidence::{Evidence, Shown, State};
use super::pattern::Pattern;
use super::plane::Plane;
use super::shadow::{Shadows, thrown};
use super::{Place, Sight};
use glam::DVec3;
use rayon::prelude::*;

/// Of the eight directions in the plane, those in which a hole has to be bounded by what is seen.
const BOUNDED_MIN: usize = 6;
/// Most cells along a side.
const SIDE_MAX: usize = 1024;
/// Least share of the views that tell of a cell in which a surface is shown, rather than the removed object, for its
/// colour to go on elsewhere: at the foot of an object few views shape what is there, and it has some of its colour.
const OWN_SHARE_MIN: f64 = 0.65;
/// Distance within which the mean of colours is what changes slowly, in cells.
const SLOW_CELLS: usize = 32;
/// Largest change of a colour in a round that ends them: far less than a step of 8 bits.
const CHANGE_MIN: f64 = 1e-5;
/// Most rounds and over-relaxation of the colours.
const ROUNDS_MAX: usize = 600;
const OVER_RELAXATION: f64 = 1.9;

/// The cells of a plane around a removed object, row-major.
pub(super) struct Sheet {
    pub plane: Plane,
    pub cell: f64,
    /// Position of cell (0, 0) along the axes of the plane, world units.
    corner: [f64; 2],
    pub width: usize,
    pub height: usize,
    /// Label of the surface.
    pub label: u32,
    states: Vec<State>,
    /// Mean colour over the views that show it; `None` where none does.
    pub colours: Vec<Option<DVec3>>,
    /// Whether enough views show a cell for its colour to go on elsewhere.
    is_shown: Vec<bool>,
}

/// Steps to the cells beside one.
pub(super) const STEPS_BESIDE: [[isize; 2]; 4] = [[-1, 0], [1, 0], [0, -1], [0, 1]];
/// Steps in all directions.
const STEPS_AROUND: [[isize; 2]; 8] = [[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1]];

impl Sheet {
    /// Looks at the cells of a plane, the surface of a label, in every view: at those around the object, and those in
    /// its shadow if light comes from a direction.
    pub(super) fn new(
        (plane, label): (Plane, u32),
        place: &Place,
        (towards, cell): (Option<DVec3>, f64),
        removed: &[u32],
        sights: &[Sight],
    ) -> Self {
        let corners = (0..8).flat_map(|bits: u32| {
            let side = |axis: usize| if bits >> axis & 1 == 0 { place.low[axis] } else { place.high[axis] };
            let corner = DVec3::new(side(0), side(1), side(2));
            let shadow = towards.and_then(|towards| thrown(&plane, towards, corner)).unwrap_or(corner);
            [corner - plane.origin, shadow - plane.origin]
        });
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for from in corners {
            for (axis, at) in [from.dot(plane.u), from.dot(plane.v)].into_iter().enumerate() {
                low[axis] = low[axis].min(at - place.ring);
                high[axis] = high[axis].max(at + place.ring);
            }
        }
        let cells = |axis: usize| (((high[axis] - low[axis]) / cell).ceil() as usize).clamp(1, SIDE_MAX);
        let (width, height) = (cells(0), cells(1));
        let (states, colours, is_shown) = (Vec::new(), Vec::new(), Vec::new());
        let mut sheet = Self { plane, cell, corner: low, width, height, label, states, colours, is_shown };
        let look = |index: usize| sheet.look(sheet.place(index), label, removed, sights);
        let looks: (Vec<State>, (Vec<_>, Vec<_>)) = (0..width * height).into_par_iter().map(look).unzip();
        (sheet.states, (sheet.colours, sheet.is_shown)) = looks;
        sheet
    }

    /// Returns the world position of the middle of a cell.
    fn place(&self, index: usize) -> DVec3 {
        let (x, y) = ((index % self.width) as f64 + 0.5, (index / self.width) as f64 + 0.5);
        let plane = &self.plane;
        plane.origin + (self.corner[0] + x * self.cell) * plane.u + (self.corner[1] + y * self.cell) * plane.v
    }

    /// Returns the index of the cell so many cells further along both axes; `None` outside.
    pub(super) fn step(&self, index: usize, [dx, dy]: [isize; 2]) -> Option<usize> {
        let x = (index % self.width).checked_add_signed(dx).filter(|&x| x < self.width)?;
        let y = (index / self.width).checked_add_signed(dy).filter(|&y| y < self.height)?;
        Some(y * self.width + x)
    }

    /// Returns the cell coordinates of a world position.
    pub(super) fn at(&self, world: DVec3) -> [f64; 2] {
        let from = world - self.plane.origin;
        let [x, y] = [self.plane.u, self.plane.v].map(|axis| from.dot(axis));
        [(x - self.corner[0]) / self.cell, (y - self.corner[1]) / self.cell]
    }

    /// Returns the index of the cell of a world position; `None` outside.
    pub(super) fn index(&self, world: DVec3) -> Option<usize> {
        let [x, y] = self.at(world);
        let is_inside = x >= 0.0 && y >= 0.0 && x < self.width as f64 && y < self.height as f64;
        is_inside.then(|| y as usize * self.width + x as usize)
    }

    /// Returns the state of a place on the surface of a label, its colour, and whether enough views show it.
    fn look(&self, world: DVec3, label: u32, removed: &[u32], sights: &[Sight]) -> (State, (Option<DVec3>, bool)) {
        let (mut evidence, mut sum, mut count) = (Evidence::default(), DVec3::ZERO, 0.0);
        for sight in sights {
            let Some((index, shown)) = evidence.add(world, (&self.plane, label), self.cell, removed, sight) else {
                continue;
            };
            if u32::from(sight.labels.ids[index]) != label || shown != Shown::Surface {
                continue;
            }
            evidence.own += 1;
            // Pixels at the contour of the object have some of its colour.
            if !sight.is_beside(index, removed) {
                sum += DVec3::from_array(sight.rgb[index].map(|value| f64::from(value.clamp(0.0, 1.0))));
                count += 1.0;
            }
        }
        let state = evidence.state();
        let colour = (state == State::Seen && count > 0.0).then(|| sum / count);
        (state, (colour, evidence.share() >= OWN_SHARE_MIN))
    }

    /// Returns the cells of the holes that seen surface surrounds. What was closed bounds the next ones: a hole beside
    /// another that nothing bounds is closed up to it.
    pub(super) fn holes(&self) -> Vec<usize> {
        let mut states = self.states.clone();
        let mut open: Vec<usize> = (0..states.len()).filter(|&index| states[index] == State::Hole).collect();
        let mut closed = Vec::new();
        loop {
            let sides: Vec<Vec<bool>> = STEPS_AROUND.par_iter().map(|&step| self.meets(&states, step)).collect();
            let is_bounded = |index: &usize| sides.iter().filter(|seen| seen[*index]).count() >= BOUNDED_MIN;
            let (found, left): (Vec<usize>, Vec<usize>) = open.into_iter().partition(is_bounded);
            if found.is_empty() {
                break;
            }
            found.iter().for_each(|&index| states[index] = State::Seen);
            closed.extend(found);
            open = left;
        }
        closed.sort_unstable();
        closed
    }

    /// Returns true for a cell of the surface that views show.
    pub(super) fn is_seen(&self, index: usize) -> bool {
        self.states[index] == State::Seen
    }

    /// Returns positions and colours of some cells. `shadows` on the sheet change the colours, and a pattern of it goes
    /// on.
    pub(super) fn painted(
        &self,
        cells: &[usize],
        shadows: Option<&Shadows>,
        pattern: Option<&Pattern>,
    ) -> Vec<(DVec3, DVec3)> {
        let Some(colours) = self.continued(shadows, pattern) else { return Vec::new() };
        let after = |index: usize| shadows.map_or(DVec3::ONE, |shadows| shadows.after(index));
        let shaded = |index: usize| (colours[index] * after(index)).clamp(DVec3::ZERO, DVec3::ONE);
        cells.iter().map(|&index| (self.place(index), shaded(index))).collect()
    }

    /// Returns for each cell whether there is seen surface in a direction, before anything free.
    fn meets(&self, states: &[State], direction: [isize; 2]) -> Vec<bool> {
        let mut seen = vec![false; states.len()];
        let meets = |seen: &[bool], index: usize| {
            self.step(index, direction).is_some_and(|at| match states[at] {
                State::Seen => true,
                State::Free => false,
                State::Hole | State::Unknown => seen[at],
            })
        };
        // The next cell comes before this one.
        let is_ahead = direction[1] > 0 || (direction[1] == 0 && direction[0] > 0);
        for at in 0..states.len() {
            let index = if is_ahead { states.len() - 1 - at } else { at };
            seen[index] = meets(&seen, index);
        }
        seen
    }

    /// Returns the colours without any shadow, but for those at edges of shadows, and those that few views show, if
    /// there are others.
    pub(super) fn lit(&self, shadows: Option<&Shadows>) -> Vec<Option<DVec3>> {
        let cells = 0..self.colours.len();
        let before = |index: usize| shadows.map_or(DVec3::ONE, |shadows| shadows.before(index));
        let lit: Vec<Option<DVec3>> =
            cells.clone().map(|index| self.colours[index].map(|colour| colour / before(index))).collect();
        let is_unsure = |index: usize| shadows.is_some_and(|shadows| shadows.is_unsure(index));
        let sure = |index: usize| lit[index].filter(|_| self.is_shown[index] && !is_unsure(index));
        let found: Vec<Option<DVec3>> = cells.map(sure).collect();
        if found.iter().any(Option::is_some) { found } else { lit }
    }

    /// Returns colours without what changes slowly.
    pub(super) fn detail(&self, colours: &[Option<DVec3>]) -> Vec<Option<DVec3>> {
        let slow = means(self, colours, SLOW_CELLS);
        colours.iter().zip(slow).map(|(&colour, slow)| Some(colour? - slow?)).collect()
    }

    /// Returns a colour for each cell: where none is known, the smoothest continuation (each the mean of its four
    /// neighbours, free cells left out) of what a pattern leaves, with the pattern; all without shadows. `None` without
    /// any known colour.
    pub(super) fn continued(&self, shadows: Option<&Shadows>, pattern: Option<&Pattern>) -> Option<Vec<DVec3>> {
        let added = |index: usize| pattern.map_or(DVec3::ZERO, |pattern| pattern.at(self.place(index)));
        let added: Vec<DVec3> = (0..self.colours.len()).into_par_iter().map(added).collect();
        let lit = self.lit(shadows).into_iter().zip(&added);
        let lit: Vec<Option<DVec3>> = lit.map(|(colour, &added)| Some(colour? - added)).collect();
        let known: Vec<DVec3> = lit.iter().flatten().copied().collect();
        if known.is_empty() {
            return None;
        }
        let mean = known.iter().sum::<DVec3>() / known.len() as f64;
        let mut colours: Vec<DVec3> = lit.iter().map(|colour| colour.unwrap_or(mean)).collect();
        let is_there = |index: usize| self.states[index] != State::Free;
        let beside = |index: usize| STEPS_BESIDE.iter().filter_map(move |&step| self.step(index, step));
        let unknown: Vec<(usize, Vec<usize>)> = (0..colours.len())
            .filter(|&index| lit[index].is_none() && is_there(index))
            .map(|index| (index, beside(index).filter(|&at| is_there(at)).collect()))
            .filter(|(_, around): &(usize, Vec<usize>)| !around.is_empty())
            .collect();
        for _ in 0..ROUNDS_MAX {
            let mut largest = 0.0_f64;
            for (index, around) in &unknown {
                let goal = around.iter().map(|&at| colours[at]).sum::<DVec3>() / around.len() as f64;
                let change = OVER_RELAXATION * (goal - colours[*index]);
                colours[*index] += change;
                largest = largest.max(change.abs().max_element());
            }
            if largest < CHANGE_MIN {
                break;
            }
        }
        Some(colours.into_iter().zip(added).map(|(colour, added)| colour + added).collect())
    }
}

/// Returns the mean of the colours within a square of cells around each.
pub(super) fn means(sheet: &Sheet, colours: &[Option<DVec3>], radius: usize) -> Vec<Option<DVec3>> {
    let (width, height) = (sheet.width, sheet.height);
    // Sums of all above and to the left.
    let mut sums = vec![(DVec3::ZERO, 0.0); (width + 1) * (height + 1)];
    for y in 0..height {
        let mut row = (DVec3::ZERO, 0.0);
        for x in 0..width {
            if let Some(colour) = colours[y * width + x] {
                row = (row.0 + colour, row.1 + 1.0);
            }
            let above = sums[y * (width + 1) + x + 1];
            sums[(y + 1) * (width + 1) + x + 1] = (above.0 + row.0, above.1 + row.1);
        }
    }
    let mean = |index: usize| {
        let (x, y) = (index % width, index / width);
        let (left, right) = (x.saturating_sub(radius), (x + radius + 1).min(width));
        let (top, bottom) = (y.saturating_sub(radius), (y + radius + 1).min(height));
        let at = |x: usize, y: usize| sums[y * (width + 1) + x];
        let corners = [at(right, bottom), at(left, top), at(left, bottom), at(right, top)];
        let sum = corners[0].0 + corners[1].0 - corners[2].0 - corners[3].0;
        let count = corners[0].1 + corners[1].1 - corners[2].1 - corners[3].1;
        (count > 0.0).then(|| sum / count)
    };
    (0..colours.len()).into_par_iter().map(mean).collect()
}
