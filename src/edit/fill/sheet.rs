//! A plane as a grid of cells: what the views show of each, and the colour of those that none shows.

use super::evidence::{Evidence, Shown, State};
use super::plane::Plane;
use super::{Place, Sight};
use glam::DVec3;
use rayon::prelude::*;

/// Of the eight directions in the plane, those in which a hole has to be bounded by what is seen.
const BOUNDED_MIN: usize = 6;
/// Most cells along a side.
const SIDE_MAX: usize = 1024;
/// Rounds and over-relaxation of the colours.
const ROUNDS: usize = 600;
const RELAXATION: f64 = 1.9;

/// The cells of a plane around a removed object, row-major.
pub(super) struct Sheet {
    pub plane: Plane,
    cell: f64,
    /// Position of cell (0, 0) along the axes of the plane, world units.
    corner: [f64; 2],
    width: usize,
    height: usize,
    states: Vec<State>,
    /// Mean colour over the views that show it; `None` where none does.
    colours: Vec<Option<DVec3>>,
}

impl Sheet {
    /// Looks at the cells of a plane, the surface of a label, in every view.
    pub(super) fn new((plane, label): (Plane, u32), place: &Place, removed: &[u32], sights: &[Sight]) -> Self {
        let corners = (0..8).map(|bits: u32| {
            let side = |axis: usize| if bits >> axis & 1 == 0 { place.low[axis] } else { place.high[axis] };
            DVec3::new(side(0), side(1), side(2)) - plane.origin
        });
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for from in corners {
            for (axis, at) in [from.dot(plane.u), from.dot(plane.v)].into_iter().enumerate() {
                low[axis] = low[axis].min(at - place.ring);
                high[axis] = high[axis].max(at + place.ring);
            }
        }
        let cells = |axis: usize| (((high[axis] - low[axis]) / place.cell).ceil() as usize).clamp(1, SIDE_MAX);
        let (width, height) = (cells(0), cells(1));
        let mut sheet =
            Self { plane, cell: place.cell, corner: low, width, height, states: Vec::new(), colours: Vec::new() };
        let look = |index: usize| sheet.look(sheet.place(index), label, removed, sights);
        (sheet.states, sheet.colours) = (0..width * height).into_par_iter().map(look).unzip();
        sheet
    }

    /// Returns the world position of the middle of a cell.
    fn place(&self, index: usize) -> DVec3 {
        let (x, y) = ((index % self.width) as f64 + 0.5, (index / self.width) as f64 + 0.5);
        let plane = &self.plane;
        plane.origin + (self.corner[0] + x * self.cell) * plane.u + (self.corner[1] + y * self.cell) * plane.v
    }

    /// Returns the state of a place on the surface of a label, and its colour.
    fn look(&self, world: DVec3, label: u32, removed: &[u32], sights: &[Sight]) -> (State, Option<DVec3>) {
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
        (state, colour)
    }

    /// Returns positions and colours of the holes that seen surface surrounds. What was closed bounds the next ones: a hole
    /// beside another that nothing bounds is closed up to it.
    pub(super) fn holes(&self) -> Vec<(DVec3, DVec3)> {
        let mut states = self.states.clone();
        let mut open: Vec<usize> = (0..states.len()).filter(|&index| states[index] == State::Hole).collect();
        let mut closed = Vec::new();
        loop {
            let (found, left): (Vec<usize>, Vec<usize>) =
                open.into_par_iter().partition(|&index| self.is_bounded(&states, index));
            if found.is_empty() {
                break;
            }
            found.iter().for_each(|&index| states[index] = State::Seen);
            closed.extend(found);
            open = left;
        }
        if closed.is_empty() {
            return Vec::new();
        }
        closed.sort_unstable();
        let Some(colours) = self.continued() else { return Vec::new() };
        closed.into_iter().map(|index| (self.place(index), colours[index])).collect()
    }

    /// Returns true if there is seen surface in most directions, before anything free.
    fn is_bounded(&self, states: &[State], index: usize) -> bool {
        let directions = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)];
        let meets = |&(dx, dy): &(isize, isize)| {
            let (mut x, mut y) = ((index % self.width) as isize, (index / self.width) as isize);
            loop {
                (x, y) = (x + dx, y + dy);
                if x < 0 || y < 0 || x >= self.width as isize || y >= self.height as isize {
                    return false;
                }
                match states[y as usize * self.width + x as usize] {
                    State::Seen => return true,
                    State::Free => return false,
                    State::Hole | State::Unknown => {}
                }
            }
        };
        directions.iter().filter(|direction| meets(direction)).count() >= BOUNDED_MIN
    }

    /// Returns a colour for each cell: where none is known, the smoothest continuation (each the mean of its four
    /// neighbours, free cells left out). `None` without any known colour.
    fn continued(&self) -> Option<Vec<DVec3>> {
        let known: Vec<DVec3> = self.colours.iter().flatten().copied().collect();
        if known.is_empty() {
            return None;
        }
        let mean = known.iter().sum::<DVec3>() / known.len() as f64;
        let mut colours: Vec<DVec3> = self.colours.iter().map(|colour| colour.unwrap_or(mean)).collect();
        let (width, height) = (self.width, self.height);
        let is_there = |index: usize| self.states[index] != State::Free;
        let unknown: Vec<(usize, Vec<usize>)> = (0..colours.len())
            .filter(|&index| self.colours[index].is_none() && is_there(index))
            .map(|index| {
                let (x, y) = (index % width, index / width);
                let around = [
                    (x > 0).then(|| index - 1),
                    (x + 1 < width).then(|| index + 1),
                    (y > 0).then(|| index - width),
                    (y + 1 < height).then(|| index + width),
                ];
                (index, around.into_iter().flatten().filter(|&at| is_there(at)).collect())
            })
            .filter(|(_, around): &(usize, Vec<usize>)| !around.is_empty())
            .collect();
        for _ in 0..ROUNDS {
            for (index, around) in &unknown {
                let goal = around.iter().map(|&at| colours[at]).sum::<DVec3>() / around.len() as f64;
                let old = colours[*index];
                colours[*index] = old + RELAXATION * (goal - old);
            }
        }
        Some(colours.into_iter().map(|colour| colour.clamp(DVec3::ZERO, DVec3::ONE)).collect())
    }
}
