//! Shadows on a plane: those of the removed objects, which go, and those of the rest, which stay.

use super::Place;
use super::evidence::on_surface;
use super::light::Light;
use super::plane::Plane;
use super::sheet::{STEPS_BESIDE, Sheet};
use glam::{DVec2, DVec3};
use labelgs_scene::Gaussians;
use labelgs_scene::harmonics::{sh0_of, value_of};
use rayon::prelude::*;

/// Least sine of the angle between the light and a plane with shadows.
pub(super) const LIGHT_SINE_MIN: f64 = 0.25;
/// Least radius of what throws a shadow, in cells: Gaussians of one surface leave no light between them.
const DISC_RADIUS_MIN: f64 = 1.5;
/// Spots of the light: one in the middle and a ring around it, and its radius as the tangent of the angle. A shadow has
/// soft edges, those of a model more so than those of a photo.
const LIGHT_SPOTS: usize = 6;
const LIGHT_RADIUS: f64 = 0.06;
/// Distance from the edge of a shadow at which it is sure on which side a place is, in cells.
const EDGE_CELLS: usize = 2;
/// Distance from the object at which other things that throw shadows are looked for, in its diagonals.
const BLOCKERS_WITHIN: f64 = 1.5;

/// What stands in the light: a Gaussian.
#[derive(Clone, Copy, Debug)]
pub(super) struct Disc {
    pub middle: DVec3,
    /// Middle one of its three standard deviations, world units.
    pub radius: f64,
}

impl Disc {
    pub(super) fn of(model: &Gaussians, row: usize) -> Self {
        let mut scales = model.scales[row];
        scales.sort_unstable_by(f32::total_cmp);
        Self { middle: model.world(row), radius: f64::from(scales[1]).exp() }
    }
}

/// Returns the Gaussians of a model that are not clear.
pub(super) fn discs(model: &Gaussians) -> Vec<Disc> {
    let is_there = |row: &usize| model.is_finite(*row) && model.opacities[*row] > 0.0;
    (0..model.len()).filter(is_there).map(|row| Disc::of(model, row)).collect()
}

/// Returns those that stand above a plane around an object.
pub(super) fn above(discs: &[Disc], place: &Place, plane: &Plane) -> Vec<Disc> {
    let around = BLOCKERS_WITHIN * place.size();
    let stands = |disc: &Disc| plane.height(disc.middle) > on_surface(place.cell) && place.has(disc, around);
    discs.iter().copied().filter(stands).collect()
}

/// Shares of the light that things keep from the cells of a sheet, 0 to 1.
pub(super) struct Shadows {
    removed: Vec<f64>,
    /// Cells beside an edge of them.
    is_edge: Vec<bool>,
    others: Vec<f64>,
    shade: DVec3,
}

impl Shadows {
    /// Finds the shadows of the removed objects and of the others.
    pub(super) fn of(sheet: &Sheet, light: &Light, removed: &[Disc], others: &[Disc]) -> Self {
        let (removed, others) = (soft(sheet, light.towards, removed), soft(sheet, light.towards, others));
        let is_edge = (0..removed.len()).into_par_iter().map(|index| is_mixed(sheet, &removed, index)).collect();
        Self { removed, is_edge, others, shade: light.shade }
    }

    /// Returns true near an edge, where it is unsure what colour a cell has in the light.
    pub(super) fn is_unsure(&self, index: usize) -> bool {
        self.is_edge[index]
    }

    /// Returns the share of its colour in the light that a cell has.
    pub(super) fn before(&self, index: usize) -> DVec3 {
        self.left(self.removed[index].max(self.others[index]))
    }

    /// Returns the same without the removed objects.
    pub(super) fn after(&self, index: usize) -> DVec3 {
        self.left(self.others[index])
    }

    fn left(&self, shadow: f64) -> DVec3 {
        DVec3::ONE - shadow * (DVec3::ONE - self.shade)
    }

    /// Brings Gaussians of the surface out of the shadow of the removed, each at most once.
    pub(super) fn lift(&self, sheet: &Sheet, model: &mut Gaussians, is_lit: &mut [bool]) {
        for row in 0..is_lit.len() {
            let world = model.world(row);
            let is_on = model.label(row) == sheet.label && sheet.plane.height(world).abs() <= on_surface(sheet.cell);
            let Some(index) = sheet.index(world).filter(|_| is_on && !is_lit[row]) else { continue };
            let gain = self.after(index) / self.before(index);
            if gain.max_element() < 1.0 + 1e-3 {
                continue;
            }
            is_lit[row] = true;
            for (channel, gain) in gain.to_array().into_iter().enumerate() {
                let sh0 = &mut model.sh0[row][channel];
                *sh0 = sh0_of(gain * value_of(*sh0));
                model.rest_mut(row).iter_mut().for_each(|band| band[channel] *= gain as f32);
            }
        }
    }
}

/// Returns true if shadows differ within [`EDGE_CELLS`] cells.
fn is_mixed(sheet: &Sheet, shadow: &[f64], index: usize) -> bool {
    let (x, y) = (index % sheet.width, index / sheet.width);
    let range = |at: usize, side: usize| at.saturating_sub(EDGE_CELLS)..(at + EDGE_CELLS + 1).min(side);
    let mut around = range(y, sheet.height).flat_map(|y| range(x, sheet.width).map(move |x| y * sheet.width + x));
    around.any(|at| shadow[at] != shadow[index])
}

/// Returns the mean shadow over spots of the light.
pub(super) fn soft(sheet: &Sheet, towards: DVec3, discs: &[Disc]) -> Vec<f64> {
    let (u, v) = towards.any_orthonormal_pair();
    let around =
        (0..LIGHT_SPOTS).map(|spot| DVec2::from_angle(std::f64::consts::TAU * spot as f64 / LIGHT_SPOTS as f64));
    let spots: Vec<DVec3> = std::iter::once(DVec2::ZERO)
        .chain(around)
        .map(|at| (towards + LIGHT_RADIUS * (at.x * u + at.y * v)).normalize())
        .collect();
    let masks: Vec<Vec<bool>> = spots.par_iter().map(|&towards| hard(sheet, towards, discs)).collect();
    let share = |index: usize| masks.iter().filter(|mask| mask[index]).count() as f64 / masks.len() as f64;
    (0..sheet.width * sheet.height).map(share).collect()
}

/// Returns the cells in the shadow of discs above the sheet, without those at its edge: discs are drawn too large for
/// it.
pub(super) fn hard(sheet: &Sheet, towards: DVec3, discs: &[Disc]) -> Vec<bool> {
    let wide = drawn(sheet, towards, discs);
    let is_wide = |at: usize| wide[at];
    let is_inside =
        |index: usize| wide[index] && STEPS_BESIDE.iter().all(|&step| sheet.step(index, step).is_none_or(is_wide));
    (0..wide.len()).map(is_inside).collect()
}

fn drawn(sheet: &Sheet, towards: DVec3, discs: &[Disc]) -> Vec<bool> {
    let mut mask = vec![false; sheet.width * sheet.height];
    for disc in discs {
        let Some(place) = thrown(&sheet.plane, towards, disc.middle) else { continue };
        let ([x, y], radius) = (sheet.at(place), (disc.radius / sheet.cell).max(DISC_RADIUS_MIN));
        let range =
            |at: f64, side: usize| (at - radius).max(0.0) as usize..((at + radius).max(0.0) as usize + 1).min(side);
        for row in range(y, sheet.height) {
            for column in range(x, sheet.width) {
                let off = DVec2::new(column as f64 + 0.5 - x, row as f64 + 0.5 - y);
                mask[row * sheet.width + column] |= off.length_squared() <= radius * radius;
            }
        }
    }
    mask
}

/// Returns where the shadow of a point falls on a plane; `None` where it is below, or the light almost in the plane.
pub(super) fn thrown(plane: &Plane, towards: DVec3, point: DVec3) -> Option<DVec3> {
    let (height, slope) = (plane.height(point), towards.dot(plane.normal));
    (height > 0.0 && slope > LIGHT_SINE_MIN).then(|| point - towards * (height / slope))
}
