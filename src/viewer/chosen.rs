//! The Gaussians that pages have chosen by hand. They stay here; a page knows how many there are.

use super::message::{SelectionChange, Viewpoint};
use super::painter::{Painter, SURFACE_SIDE_MAX, Source};
use crate::edit::Rows;
use crate::edit::selection::{Combine, Nearby, Region, Shape, beyond, in_region, in_sphere};
use crate::edit::strokes::{GraphCut, Seed};
use crate::error::{Error, Result};
use crate::render::Parts;
use crate::scene::{Gaussians, MODEL_LABEL_MAX, UNLABELLED};
use rayon::prelude::*;
use serde_json::{Value, json};
use std::collections::BTreeSet;

/// Temporary label of the object of strokes.
const STROKE_OBJECT_LABEL: u32 = MODEL_LABEL_MAX;

/// The selected and the locked Gaussians.
#[derive(Default)]
pub(super) struct Selection {
    rows: Vec<bool>,
    locked: Vec<bool>,
    /// The places of the model's Gaussians, once they were asked for.
    nearby: Option<Nearby>,
    /// Strokes since the last selection of another kind.
    seeds: Vec<Seed>,
    /// Their cut, with the model that it is of.
    cutting: Option<GraphCut<Box<Gaussians>>>,
}

impl Selection {
    pub(super) fn new(model: &Gaussians) -> Self {
        let none = vec![false; model.len()];
        Self { rows: none.clone(), locked: none, nearby: None, seeds: Vec::new(), cutting: None }
    }

    /// Returns for each row whether it is chosen.
    pub(super) fn mask(&self) -> &[bool] {
        &self.rows
    }

    pub(super) fn rows(&self) -> Rows {
        Rows::from_mask(&self.rows)
    }

    /// Selects as a page asks, among what is drawn and not locked.
    pub(super) fn choose(
        &mut self,
        what: &SelectionChange,
        model: &Gaussians,
        is_drawn: &[bool],
        (painter, source): (&Painter, &mut dyn Source),
    ) -> Result<()> {
        if !matches!(what, SelectionChange::Stroke { .. }) {
            self.seeds.clear();
            self.cutting = None;
        }
        let is_free: Vec<bool> = is_drawn.iter().zip(&self.locked).map(|(&drawn, &locked)| drawn && !locked).collect();
        let (found, how) = match what {
            SelectionChange::Draw { from, region, through, how } => {
                let (camera, scale, rendered) = painter.seen(from, Parts::DEPTH, Some(SURFACE_SIDE_MAX), source)?;
                let points = region.points.iter().map(|[x, y]| [x * scale[0], y * scale[1]]).collect();
                let region = Region { points, radius: region.radius * scale[0], shape: region.shape };
                let depth = if *through { None } else { Some(rendered.mean_depth()?) };
                (in_region(model, &camera, &region, depth.as_deref()), *how)
            }
            SelectionChange::Ball { from, pixel, radius, how } => {
                let spot = painter.surface(from, *pixel, source)?;
                let size = radius * spot.depth / spot.camera.fx;
                (in_sphere(model, spot.place, size), *how)
            }
            SelectionChange::Depth { from, pixel, side, how } => {
                let spot = painter.surface(from, *pixel, source)?;
                (beyond(model, &spot.camera, spot.depth, *side), *how)
            }
            SelectionChange::Flood { from, pixel, tolerance, how } => {
                let first = painter.surface(from, *pixel, source)?.row;
                let none = || Error::usage("point", "everything here is locked; unlock it first");
                let first = Some(first).filter(|&row| is_free[row]).ok_or_else(none)?;
                (self.nearby(model)?.flood(model, first, *tolerance, &is_free), *how)
            }
            SelectionChange::Stroke { from, points, radius, on } => {
                let hit = hit(from, (points, *radius), (painter, source))?;
                let label = if *on { STROKE_OBJECT_LABEL } else { UNLABELLED };
                let seeds: Vec<Seed> = hit.into_iter().map(|row| Seed { row, label, is_on: true }).collect();
                (self.cut(model, &seeds)?, Combine::Replace)
            }
            SelectionChange::Labels { labels, how } => {
                ((0..model.len()).map(|row| labels.contains(&model.label(row))).collect(), *how)
            }
            SelectionChange::Grow => {
                let before = self.rows.clone();
                (self.nearby(model)?.grown(&before), Combine::Add)
            }
            SelectionChange::Shrink => {
                let before = self.rows.clone();
                (self.nearby(model)?.shrunk(&before), Combine::Within)
            }
            SelectionChange::Invert => (self.rows.iter().map(|&is_in| !is_in).collect(), Combine::Replace),
            SelectionChange::Nothing => (vec![false; model.len()], Combine::Replace),
            SelectionChange::Lock => {
                self.locked.iter_mut().zip(&self.rows).for_each(|(locked, &is_in)| *locked |= is_in);
                (vec![false; model.len()], Combine::Replace)
            }
            SelectionChange::Unlock => {
                self.locked.fill(false);
                return Ok(());
            }
        };
        let found: Vec<bool> = found.into_iter().zip(is_free).map(|(is_in, is_free)| is_in && is_free).collect();
        self.rows = how.join(&self.rows, &found);
        Ok(())
    }

    /// Returns the object of the strokes. Before one is on something else, that is what they hit.
    fn cut(&mut self, model: &Gaussians, seeds: &[Seed]) -> Result<Vec<bool>> {
        self.seeds.extend(seeds);
        let is_one_sided = self.seeds.iter().all(|seed| seed.label == STROKE_OBJECT_LABEL);
        let mut cutting = match self.cutting.take() {
            Some(cutting) => cutting,
            None => GraphCut::new(Box::new(model.clone()))?,
        };
        cutting.add(seeds);
        let mut rows = vec![false; model.len()];
        if is_one_sided {
            self.seeds.iter().for_each(|seed| rows[seed.row] = true);
        } else {
            rows = cutting.cut()?.into_iter().map(|label| label == STROKE_OBJECT_LABEL).collect();
        }
        self.cutting = Some(cutting);
        Ok(rows)
    }

    fn nearby(&mut self, model: &Gaussians) -> Result<&Nearby> {
        let nearby = match self.nearby.take() {
            Some(nearby) => nearby,
            None => Nearby::new(model)?,
        };
        Ok(self.nearby.insert(nearby))
    }

    pub(super) fn describe(&self) -> Value {
        let count = |rows: &[bool]| rows.iter().filter(|is_in| **is_in).count();
        json!({ "kind": "chosen", "count": count(&self.rows), "locked": count(&self.locked) })
    }
}

/// Returns the main Gaussians of the pixels of a stroke over a full image.
fn hit(
    from: &Viewpoint,
    (points, radius): (&[[f64; 2]], f64),
    (painter, source): (&Painter, &mut dyn Source),
) -> Result<Vec<usize>> {
    let (camera, scale, rendered) = painter.seen(from, Parts::MAIN, Some(SURFACE_SIDE_MAX), source)?;
    let most = [f64::from(camera.width), f64::from(camera.height)].map(|side| side - 0.5);
    let points = points.iter().map(|point| [0, 1].map(|axis| (point[axis] * scale[axis]).clamp(0.0, most[axis])));
    let region = Region { shape: Shape::Along, points: points.collect(), radius: (radius * scale[0]).max(0.5) };
    let is_hit = |pixel: &usize| region.has(camera.pixel_centre(*pixel));
    let pixels: Vec<usize> = (0..rendered.top_id.len()).into_par_iter().filter(is_hit).collect();
    let rows: BTreeSet<usize> =
        pixels.iter().filter_map(|&pixel| usize::try_from(rendered.top_id[pixel]).ok()).collect();
    let none = || Error::usage("stroke", "there is no Gaussian here");
    if rows.is_empty() { Err(none()) } else { Ok(rows.into_iter().map(|row| source.row(row)).collect()) }
}
