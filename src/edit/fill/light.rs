//! The light of a scene, by the shadows of its objects: if it comes from a direction, colours change where the shadows
//! that the objects would throw from there end.

use super::plane::planes;
use super::shadow::{Disc, LIGHT_SINE_MIN, hard, soft};
use super::sheet::{STEPS_BESIDE, Sheet};
use super::{Place, Sight};
use crate::select::summarise;
use glam::DVec3;
use labelgs_scene::direction::even_direction;
use labelgs_scene::{Gaussians, Result, UNLABELLED};
use rayon::prelude::*;
use std::cmp::Reverse;

/// Most objects that are asked, those with most Gaussians first, and Gaussians of each.
const OBJECTS_MAX: usize = 32;
const DISCS_MAX: usize = 4000;
/// Most cells along an object and as much again on either side of it.
const SIDE_CELLS_MAX: f64 = 320.0;
/// Directions that are tried, and rounds of 5 x 5 finer ones around the best, with half the step each.
const DIRECTION_COUNT: usize = 800;
const REFINEMENT_ROUNDS: i32 = 4;
const STEP_FIRST: f64 = 0.06;
/// Score from which a light is one, and brightest shadow that it may throw. Where light comes from all sides, the best
/// direction has a score of chance, and what is inside of its shadows is about as bright as what is outside. Windows of
/// a room have scores up to 9.1.
const SCORE_MIN: f64 = 10.0;
const SHADE_MAX: f64 = 0.7;
/// Distance of two colours from the edge of a shadow, in cells.
const EDGE_DISTANCE: isize = 3;
/// Largest change of the logarithm of a colour that counts, and what is added to the colour before.
const CHANGE_MAX: f64 = 1.0;
const COLOUR_OFFSET: f64 = 0.02;
/// Depth behind its edge at which a shadow is as dark as it gets, in cells, and its widest soft edge.
const SHADOW_DEPTH: isize = 4;
const SOFT_EDGE_MAX: isize = 16;
/// Darkest shadow.
const SHADE_MIN: f64 = 0.1;

/// A light far away in one direction, such as the sun.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// Unit vector to it.
    pub towards: DVec3,
    /// Colour in its shadow, as a share of that beside it: r, g, b.
    pub shade: DVec3,
}

impl Light {
    /// Finds the light of a labelled model by `sights`, views of the whole model; `None` where no shadows tell it.
    /// Errors if an object cannot be searched.
    pub fn of(model: &Gaussians, sights: &[Sight]) -> Result<Option<Self>> {
        let stands = stands(model, sights)?;
        let best = |tried: Vec<DVec3>| {
            let scored: Vec<(f64, DVec3)> = tried.into_par_iter().map(|at| (score(&stands, at), at)).collect();
            scored.into_iter().max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or_default()
        };
        let mut found = best((0..DIRECTION_COUNT).map(|index| even_direction(index, DIRECTION_COUNT)).collect());
        for round in 0..REFINEMENT_ROUNDS {
            let (towards, step) = (found.1, STEP_FIRST * 0.5_f64.powi(round));
            let (u, v) = towards.any_orthonormal_pair();
            let near = |k: i32| (towards + step * (f64::from(k % 5 - 2) * u + f64::from(k / 5 - 2) * v)).normalize();
            found = best((0..25).map(near).collect());
        }
        let (score, towards) = found;
        let shade = shade(&stands, towards);
        let mean = shade.element_sum() / 3.0;
        tracing::debug!("light: score {score:.1} from {towards:.3}, shadows have {mean:.2} of the colours beside them");
        Ok((score >= SCORE_MIN && mean <= SHADE_MAX).then_some(Self { towards, shade }))
    }
}

/// An object and a plane beside it.
struct Stand {
    sheet: Sheet,
    discs: Vec<Disc>,
}

/// Returns the objects of the model with the planes around them.
fn stands(model: &Gaussians, sights: &[Sight]) -> Result<Vec<Stand>> {
    let mut objects = summarise(model);
    objects.retain(|object| object.label != UNLABELLED);
    objects.sort_by_key(|object| Reverse(object.count));
    let mut stands = Vec::new();
    for label in objects.iter().take(OBJECTS_MAX).map(|object| object.label) {
        let Some(place) = Place::new(model, label, sights)? else { continue };
        let step = place.discs.len().div_ceil(DISCS_MAX).max(1);
        let discs: Vec<Disc> = place.discs.iter().copied().step_by(step).collect();
        let size = place.size();
        let wide = Place { ring: size, ..place };
        let cell = wide.cell.max(3.0 * size / SIDE_CELLS_MAX);
        for (surface, points) in wide.ring(&[label], sights) {
            if let Some(plane) = planes(&points, wide.cell).first() {
                let plane = plane.facing(wide.middle());
                let sheet = Sheet::new((plane, surface), &wide, (None, cell), &[label], sights);
                stands.push(Stand { sheet, discs: discs.clone() });
            }
        }
    }
    Ok(stands)
}

/// Returns how far the mean change of colours is from 0 where shadows would end, in standard errors.
fn score(stands: &[Stand], towards: DVec3) -> f64 {
    let grey = |colour: DVec3| (colour.element_sum() / 3.0 + COLOUR_OFFSET).ln();
    let (mut sum, mut squares) = (0.0, 1.0);
    for Stand { sheet, discs } in stands.iter().filter(|stand| is_steep(stand, towards)) {
        let mask = hard(sheet, towards, discs);
        for edge in edges(sheet, &mask) {
            let (Some(inside), Some(outside)) = (edge.cell(-EDGE_DISTANCE), edge.cell(EDGE_DISTANCE)) else { continue };
            let (Some(dark), Some(bright)) = (sheet.colours[inside], sheet.colours[outside]) else { continue };
            if mask[inside] && !mask[outside] {
                let change = (grey(bright) - grey(dark)).clamp(-CHANGE_MAX, CHANGE_MAX);
                sum += change;
                squares += change * change;
            }
        }
    }
    sum / squares.sqrt()
}

/// Returns how dark shadows are: the median over the edges of what is deep inside against what is wholly outside.
fn shade(stands: &[Stand], towards: DVec3) -> DVec3 {
    let mut shares: [Vec<f64>; 3] = Default::default();
    let all: Vec<Disc> = stands.iter().flat_map(|stand| &stand.discs).copied().collect();
    for Stand { sheet, discs } in stands.iter().filter(|stand| is_steep(stand, towards)) {
        let (shadow, any) = (soft(sheet, towards, discs), soft(sheet, towards, &all));
        let whole: Vec<bool> = shadow.iter().map(|&share| share == 1.0).collect();
        for edge in edges(sheet, &whole) {
            // Thin things throw no whole shadow in a model.
            let is_deep = (1..2 * SHADOW_DEPTH).all(|k| edge.cell(-k).is_some_and(|at| whole[at]));
            let dark = edge.cell(-SHADOW_DEPTH).filter(|_| is_deep).and_then(|at| sheet.colours[at]);
            // The second cell beyond the soft edge.
            let out = (1..SOFT_EDGE_MAX).map_while(|k| edge.cell(k)).skip_while(|&at| shadow[at] > 0.0).nth(1);
            let bright = out.filter(|&at| any[at] == 0.0).and_then(|at| sheet.colours[at]);
            if let (Some(dark), Some(bright)) = (dark, bright) {
                (0..3).for_each(|channel| shares[channel].push(dark[channel] / bright[channel].max(COLOUR_OFFSET)));
            }
        }
    }
    let median = |mut shares: Vec<f64>| {
        shares.sort_unstable_by(f64::total_cmp);
        shares.get(shares.len() / 2).map_or(1.0, |share| share.clamp(SHADE_MIN, 1.0))
    };
    DVec3::from_array(shares.map(median))
}

fn is_steep(stand: &Stand, towards: DVec3) -> bool {
    towards.dot(stand.sheet.plane.normal) > LIGHT_SINE_MIN
}

/// A cell of a mask beside one out of it, and the way there.
struct Edge<'a> {
    sheet: &'a Sheet,
    index: usize,
    out: [isize; 2],
}

impl Edge<'_> {
    /// Returns the index of the cell that is so many further out.
    fn cell(&self, further: isize) -> Option<usize> {
        self.sheet.step(self.index, self.out.map(|step| further * step))
    }
}

/// Returns all edges of a mask.
fn edges<'a>(sheet: &'a Sheet, mask: &'a [bool]) -> impl Iterator<Item = Edge<'a>> {
    let inside = (0..mask.len()).filter(|&index| mask[index]);
    let all = inside.flat_map(move |index| STEPS_BESIDE.map(|out| Edge { sheet, index, out }));
    all.filter(|edge| edge.cell(1).is_some_and(|beside| !mask[beside]))
}
