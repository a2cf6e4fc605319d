//! Closes what a removed object leaves open: its neighbours' surfaces are continued where no view ever looked.
//! Gaussians that the object hid in all views go with it.
//!
//! The views of the whole model say what was seen: a place on a surface is *seen* if a view shows it, *free* if a view
//! looks through it, and a *hole* if it lies at or behind the removed object in the views that tell (a tenth of them
//! may err, as they do at contours). Planes are fitted
//! to what the views show around the object. New flat Gaussians stand on these planes, only in holes between seen
//! ones, so that they cover nothing that a view has seen. Their colours continue those around them, and a pattern that
//! repeats there, such as tiles. Where there is a pattern, the plane's own Gaussians are copied into the hole too, from
//! places whole periods away. Where the scene has one strong [`Light`], the shadow of the object on these planes goes
//! with it.

mod copied;
mod evidence;
mod hidden;
mod light;
mod pattern;
mod plane;
mod shadow;
mod sheet;

pub use light::Light;

use super::select::{MIN_LABEL_CONFIDENCE, remove};
use crate::nearest::tree;
use copied::{Sources, Target};
use glam::{DMat3, DQuat, DVec3};
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use labelgs_scene::harmonics::sh0_of;
use labelgs_scene::{Camera, Error, Gaussians, LabelMap, Result, Setting};
use pattern::Pattern;
use plane::{Plane, planes};
use rayon::prelude::*;
use shadow::{Disc, Shadows};
use sheet::Sheet;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Longest side of a [`Sight`], px: finer ones take memory and add little.
pub const SIGHT_SIDE: u32 = 640;
/// Width of the ring around the object from which surfaces are continued, as a share of the object's diagonal.
const RING_DIAGONAL_SHARE: f64 = 0.25;
/// Least width of that ring, in cells.
const RING_CELLS_MIN: f64 = 8.0;
/// Width of the ring in which a pattern is looked for, as a share of the object's diagonal.
const PATTERN_RING_DIAGONAL_SHARE: f64 = 0.75;
/// Least width of that ring, in cells.
const PATTERN_RING_CELLS_MIN: f64 = 96.0;
/// Longest diagonal that counts for that ring, in widths of the object.
const PATTERN_DIAGONAL_WIDTHS_MAX: f64 = 2.0;
/// Most cells along a side of a square of the area of the object with that ring.
const PATTERN_SIDE_CELLS_MAX: f64 = 192.0;
/// Fewest cells of a hole in which a pattern goes on: the search takes time, and in fewer it cannot be told.
const PATTERN_HOLE_MIN: usize = 81;
/// Radius of the largest Gaussian that throws a shadow, as a share of the object's diagonal.
const BLOCKER_SHARE_MAX: f64 = 0.25;
/// Most points that one surface is looked for among.
const POINTS_MAX: usize = 20_000;
/// Standard deviation of a new Gaussian in its surface, in cells: neighbours overlap without gaps.
const SPREAD_IN_CELLS: f64 = 0.7;
/// The same across its surface.
const SPREAD_ACROSS_CELLS: f64 = 0.1;
/// Opacity of a new Gaussian before the sigmoid, 0.97.
const OPACITY_LOGIT: f32 = 3.5;

/// What a view shows of the whole model, row-major.
#[derive(Clone, Debug)]
pub struct Sight {
    /// The camera, at the size of the picture.
    pub camera: Camera,
    /// r, g, b.
    pub rgb: Vec<[f32; 3]>,
    /// Mean z, world units; 0 where nothing is.
    pub depth: Vec<f32>,
    /// Label of the main Gaussian of each pixel.
    pub labels: LabelMap,
}

/// A model in which the place of removed objects was closed.
#[derive(Clone, Debug, PartialEq)]
pub struct Filled {
    /// The rest of the model without what the removed objects hid, then the new Gaussians.
    pub model: Gaussians,
    /// Number of Gaussians of the rest that are left out because the objects hid them in all views.
    pub hidden: u64,
    /// Number of new Gaussians by the label of the surface that they continue.
    pub added: BTreeMap<u32, u64>,
    /// Number of Gaussians of the rest that were in the shadow of the objects and are in the light now.
    pub lit: u64,
}

/// Removes the Gaussians of `labels`, as [`remove`] does, and continues the surfaces around them where `sights`, views
/// of the whole `model`, show nothing but the removed. With a `light`, these surfaces lose the shadow of the removed.
/// Errors as in [`remove`], or without a sight.
pub fn fill(model: &Gaussians, labels: &[u32], sights: &[Sight], light: Option<&Light>) -> Result<Filled> {
    let rest = remove(model, labels)?;
    if sights.is_empty() {
        return Err(Error::usage(Setting("fill"), "needs at least one view of the scene"));
    }
    let places = labels.iter().map(|&label| Place::new(model, label, sights)).collect::<Result<Vec<_>>>()?;
    let places: Vec<Place> = places.into_iter().flatten().collect();
    let mut is_hidden = vec![false; rest.len()];
    for place in &places {
        let found = place.hidden(&rest, labels, sights);
        is_hidden.iter_mut().zip(found).for_each(|(all, one)| *all |= one);
    }
    let hidden = is_hidden.iter().filter(|&&hidden| hidden).count() as u64;
    let mut filled = Filled { model: rest.filtered(|row| !is_hidden[row]), hidden, added: BTreeMap::new(), lit: 0 };
    let mut is_lit = vec![false; filled.model.len()];
    let blockers = light.map(|light| Blockers::new(light, &places, &filled.model));
    // Each label is an object of its own: two far from each other have no common surroundings.
    for place in &places {
        for (label, points) in place.ring(labels, sights) {
            for plane in planes(&points, place.cell) {
                let surface = (plane.facing(place.middle()), label);
                let seen = Seen { removed: labels, sights, blockers: blockers.as_ref() };
                seen.close(place, surface, &mut filled, &mut is_lit);
            }
        }
    }
    filled.lit = is_lit.into_iter().filter(|&lit| lit).count() as u64;
    Ok(filled)
}

/// What stands in the light.
struct Blockers<'a> {
    light: &'a Light,
    removed: Vec<Disc>,
    kept: Vec<Disc>,
}

impl<'a> Blockers<'a> {
    fn new(light: &'a Light, places: &[Place], rest: &Gaussians) -> Self {
        let removed = places.iter().flat_map(|place| &place.discs).copied().collect();
        Self { light, removed, kept: shadow::discs(rest) }
    }
}

/// What a pattern is looked for in.
struct Surroundings {
    sheet: Sheet,
    shadows: Option<Shadows>,
    /// Colours without shadows.
    lit: Vec<Option<DVec3>>,
    /// The same without what changes slowly.
    detail: Vec<Option<DVec3>>,
}

/// What all views show, and whose shadows.
struct Seen<'a> {
    removed: &'a [u32],
    sights: &'a [Sight],
    blockers: Option<&'a Blockers<'a>>,
}

impl Seen<'_> {
    /// Looks at a surface around a place, in cells of a size.
    fn look(&self, place: &Place, surface: (Plane, u32), cell: f64) -> (Sheet, Option<Shadows>) {
        let towards = self.blockers.map(|blockers| blockers.light.towards);
        let sheet = Sheet::new(surface, place, (towards, cell), self.removed, self.sights);
        let shadows = self.blockers.map(|Blockers { light, removed, kept }| {
            Shadows::of(&sheet, light, removed, &shadow::above(kept, place, &sheet.plane))
        });
        (sheet, shadows)
    }

    /// Looks at the surroundings of a place in which a pattern may be.
    fn surroundings(&self, place: &Place, surface: (Plane, u32)) -> Surroundings {
        let (wide, cell) = place.wide();
        let (sheet, shadows) = self.look(&wide, surface, cell);
        let lit = sheet.lit(shadows.as_ref());
        let detail = sheet.detail(&lit);
        Surroundings { sheet, shadows, lit, detail }
    }

    /// Continues a surface where a removed object was.
    fn close(&self, place: &Place, surface: (Plane, u32), filled: &mut Filled, is_lit: &mut [bool]) {
        let (sheet, shadows) = self.look(place, surface, place.cell);
        if let Some(shadows) = &shadows {
            shadows.lift(&sheet, &mut filled.model, is_lit);
        }
        let holes = sheet.holes();
        if holes.is_empty() {
            return;
        }
        let around = (holes.len() >= PATTERN_HOLE_MIN).then(|| self.surroundings(place, surface));
        let pattern = around.as_ref().and_then(|around| Pattern::of(&around.sheet, &around.lit, &around.detail));
        let painted = sheet.painted(&holes, shadows.as_ref(), pattern.as_ref());
        if painted.is_empty() {
            return;
        }
        // Flat ones close the gaps between copies.
        let mut new = flat(&filled.model, (&sheet.plane, place.cell), &painted, sheet.label);
        if let (Some(pattern), Some(around)) = (&pattern, &around) {
            let target = Target { sheet: &sheet, holes: &holes, shadows: around.shadows.as_ref() };
            new.append(Sources::of(&around.sheet, pattern).copies(&filled.model, is_lit.len(), &target));
        }
        *filled.added.entry(sheet.label).or_default() += new.len() as u64;
        filled.model.append(new);
    }
}

/// Where a removed object was.
struct Place {
    tree: Arc<ImmutableKdTree<f64, 3>>,
    /// Its Gaussians.
    discs: Vec<Disc>,
    /// Corners of the object.
    low: DVec3,
    high: DVec3,
    /// Size of a pixel at the object, world units: the spacing of new Gaussians.
    cell: f64,
    /// Width of the ring around the object, world units.
    ring: f64,
}

impl Place {
    /// Finds the place of a label; `None` if no view shows it.
    fn new(model: &Gaussians, label: u32, sights: &[Sight]) -> Result<Option<Self>> {
        let of_label = |row: &usize| model.label(*row) == label;
        let is_sure = |row: &usize| {
            let shares = model.label_confidence.as_ref();
            model.opacities[*row] > 0.0 && shares.is_none_or(|shares| shares[*row] >= MIN_LABEL_CONFIDENCE)
        };
        let all: Vec<usize> = (0..model.len()).filter(of_label).filter(|&row| model.is_finite(row)).collect();
        let sure: Vec<usize> = all.iter().copied().filter(is_sure).collect();
        let rows = if sure.is_empty() { all } else { sure };
        let points: Vec<DVec3> = rows.iter().map(|&row| model.world(row)).collect();
        if points.is_empty() {
            return Ok(None);
        }
        // Single Gaussians may be anywhere, so the corners leave a few out.
        let corner = |axis: usize, share: f64| {
            let mut values: Vec<f64> = points.iter().map(|point| point[axis]).collect();
            values.sort_unstable_by(f64::total_cmp);
            values[((values.len() - 1) as f64 * share).round() as usize]
        };
        let at = |share: f64| DVec3::new(corner(0, share), corner(1, share), corner(2, share));
        let (low, high, middle) = (at(0.01), at(0.99), at(0.5));
        let mut pixels: Vec<f64> = sights
            .iter()
            .filter(|sight| sight.camera.sees(middle).is_some())
            .map(|sight| sight.camera.to_camera(middle).z / sight.camera.fx)
            .collect();
        pixels.sort_unstable_by(f64::total_cmp);
        let Some(&cell) = pixels.get(pixels.len() / 2) else { return Ok(None) };
        let places: Vec<[f64; 3]> = points.iter().map(DVec3::to_array).collect();
        let tree = tree(&places)?;
        let mut place = Self { tree: Arc::new(tree), discs: Vec::new(), low, high, cell, ring: 0.0 };
        place.ring = (RING_DIAGONAL_SHARE * place.size()).max(RING_CELLS_MIN * cell);
        place.discs = rows.iter().map(|&row| Disc::of(model, row)).filter(|disc| place.has(disc, place.ring)).collect();
        Ok(Some(place))
    }

    /// Returns true for what is within a margin of the object and not larger than a part of it: haze and sky throw no
    /// shadow.
    fn has(&self, disc: &Disc, margin: f64) -> bool {
        self.is_near(disc.middle, margin) && disc.radius < BLOCKER_SHARE_MAX * self.size()
    }

    /// Returns the place with a ring in which a pattern is looked for, and the size of the cells there.
    fn wide(&self) -> (Self, f64) {
        let mut sides = (self.high - self.low).to_array();
        sides.sort_unstable_by(f64::total_cmp);
        // Along a long thin object, as much as across it is enough.
        let size = self.size().min(PATTERN_DIAGONAL_WIDTHS_MAX * sides[1]);
        let ring = (PATTERN_RING_DIAGONAL_SHARE * size).max(PATTERN_RING_CELLS_MIN * self.cell);
        let area = (sides[1] + 2.0 * ring) * (sides[2] + 2.0 * ring);
        let cell = self.cell.max(area.sqrt() / PATTERN_SIDE_CELLS_MAX);
        (Self { ring, tree: Arc::clone(&self.tree), discs: Vec::new(), ..*self }, cell)
    }

    /// Returns the diagonal of the object.
    fn size(&self) -> f64 {
        (self.high - self.low).length()
    }

    fn middle(&self) -> DVec3 {
        0.5 * (self.low + self.high)
    }

    /// Returns the points that views show around the object, by label.
    fn ring(&self, removed: &[u32], sights: &[Sight]) -> BTreeMap<u32, Vec<DVec3>> {
        let seen = |sight: &Sight| -> Vec<(u32, DVec3)> {
            let pixels = sight.depth.iter().zip(&sight.labels.ids).enumerate();
            let point = |(index, (&depth, &id)): (usize, (&f32, &u16))| {
                if depth <= 0.0 || removed.contains(&u32::from(id)) {
                    return None;
                }
                let world = sight.at(index, f64::from(depth));
                let is_in = self.is_near(world, self.ring) && self.distance(world) <= self.ring;
                is_in.then_some((u32::from(id), world))
            };
            pixels.filter_map(point).collect()
        };
        let mut found: BTreeMap<u32, Vec<DVec3>> = BTreeMap::new();
        for (label, world) in sights.par_iter().map(seen).collect::<Vec<_>>().concat() {
            found.entry(label).or_default().push(world);
        }
        for points in found.values_mut() {
            let step = points.len().div_ceil(POINTS_MAX).max(1);
            *points = points.iter().copied().step_by(step).collect();
        }
        found
    }

    /// Returns true for points in the box around the object, grown by a margin.
    fn is_near(&self, world: DVec3, margin: f64) -> bool {
        world.max(self.low).min(self.high).distance(world) <= margin
    }

    /// Returns the distance to the nearest Gaussian of the object.
    fn distance(&self, world: DVec3) -> f64 {
        let nearest = self.tree.query(&world.to_array()).nearest_one::<SquaredEuclidean<f64>>().execute();
        nearest.distance.sqrt()
    }
}

impl Sight {
    /// Returns true for a pixel beside one of these labels.
    fn is_beside(&self, index: usize, labels: &[u32]) -> bool {
        let (x, y) = (index as u32 % self.labels.width, index as u32 / self.labels.width);
        let is_one = |x: u32, y: u32| self.labels.get(x, y).is_some_and(|id| labels.contains(&u32::from(id)));
        (x.saturating_sub(1)..=x + 1).any(|x| (y.saturating_sub(1)..=y + 1).any(|y| is_one(x, y)))
    }

    /// Returns the world position at a depth of a pixel.
    fn at(&self, index: usize, depth: f64) -> DVec3 {
        self.camera.unproject(self.camera.pixel_centre(index), depth)
    }
}

/// Returns flat Gaussians on a plane, with the columns of a model.
fn flat(model: &Gaussians, (plane, cell): (&Plane, f64), places: &[(DVec3, DVec3)], label: u32) -> Gaussians {
    let turn = DQuat::from_mat3(&DMat3::from_cols(plane.u, plane.v, plane.normal)).normalize();
    let quat = [turn.w, turn.x, turn.y, turn.z].map(|value| value as f32);
    let scale = [SPREAD_IN_CELLS, SPREAD_IN_CELLS, SPREAD_ACROSS_CELLS].map(|share| (share * cell).ln() as f32);
    let count = places.len();
    Gaussians {
        means: places.iter().map(|(world, _)| (*world - model.origin).as_vec3().to_array()).collect(),
        quats: vec![quat; count],
        scales: vec![scale; count],
        opacities: vec![OPACITY_LOGIT; count],
        sh0: places.iter().map(|(_, colour)| colour.to_array().map(sh0_of)).collect(),
        sh_rest: vec![[0.0; 3]; count * model.rest_per_gaussian()],
        labels: Some(vec![label; count]),
        label_confidence: Some(vec![1.0; count]),
        ..Gaussians::default()
    }
}
