//! Far points where photos look past all others, for example at the sky.
//!
//! Without them nothing represents distant content, and training puts Gaussians right in front of the cameras instead.

use super::texel::texel;
use glam::{DVec2, DVec3};
use labelgs_scene::direction::even_direction;
use labelgs_scene::sampling::stride;
use labelgs_scene::stage::Stage;
use labelgs_scene::{Camera, Dataset, Point, Result, View};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Radius of the sphere: at least this many scene extents, and this multiple of the given quantile of point distances.
const RADIUS_EXTENTS: f64 = 2.5;
const RADIUS_DISTANCES: f64 = 1.0;
const DISTANCE_QUANTILE: f64 = 0.99;
/// Number of cells along a photo's longer side. The photo looks past the points in cells without any.
const CELLS_PER_SIDE: u32 = 16;
/// Fewest views that must see a point of the sphere.
const VIEWS_MIN: usize = 2;

/// The cells of a photo that contain points.
struct CoveredCells {
    columns: u32,
    rows: u32,
    cells: Vec<bool>,
}

impl CoveredCells {
    fn new(camera: &Camera, points: &[Point], views: usize) -> Self {
        let longest = camera.width.max(camera.height);
        let count = |side: u32| (side * CELLS_PER_SIDE).div_ceil(longest).max(1);
        let (columns, rows) = (count(camera.width), count(camera.height));
        let mut covered = Self { columns, rows, cells: vec![false; (columns * rows) as usize] };
        // With very many points and photos, every n-th point suffices.
        for pixel in points.iter().step_by(stride(points.len(), views)).filter_map(|point| camera.sees(point.position))
        {
            let (x, y) = covered.cell(camera, pixel);
            covered.cells[(y * columns + x) as usize] = true;
        }
        covered
    }

    fn cell(&self, camera: &Camera, pixel: DVec2) -> (u32, u32) {
        let at =
            |value: f64, side: u32, count: u32| ((value / f64::from(side) * f64::from(count)) as u32).min(count - 1);
        (at(pixel.x, camera.width, self.columns), at(pixel.y, camera.height, self.rows))
    }

    fn is_covered(&self, camera: &Camera, pixel: DVec2) -> bool {
        let (x, y) = self.cell(camera, pixel);
        self.cells[(y * self.columns + x) as usize]
    }
}

/// Returns those points of a sphere of `count` directions around the cameras where most views that see them look past
/// the scene's points, with the median colour of their pixels; also returns half their spacing, world units.
pub(super) fn points(dataset: &Dataset, count: usize) -> Result<(Vec<Point>, f64)> {
    let _stage = Stage::new("looking for what lies behind all points", 0);
    let points = &dataset.points;
    let views: Vec<&View> = dataset.train.iter().filter(|view| view.photo.is_some()).collect();
    if views.is_empty() || count == 0 {
        return Ok((Vec::new(), 0.0));
    }
    let centre = views.iter().map(|view| view.camera.centre()).sum::<DVec3>() / views.len() as f64;
    let mut distances: Vec<f64> = points.iter().map(|point| point.position.distance(centre)).collect();
    let at = (DISTANCE_QUANTILE * distances.len() as f64) as usize;
    let far = if at < distances.len() { *distances.select_nth_unstable_by(at, f64::total_cmp).1 } else { 0.0 };
    let radius = (RADIUS_EXTENTS * dataset.extent()).max(RADIUS_DISTANCES * far);
    let covered: Vec<CoveredCells> =
        views.par_iter().map(|view| CoveredCells::new(&view.camera, points, views.len())).collect();
    let place = |index: usize| centre + radius * even_direction(index, count);
    // Load one photo at a time, because not all may be in memory.
    let mut shown: Vec<(usize, Vec<[u8; 3]>)> = vec![(0, Vec::new()); count];
    for (view, covered) in views.iter().zip(&covered) {
        let photo = view.photo()?;
        shown.par_iter_mut().enumerate().for_each(|(index, (past, colours))| {
            let Some(pixel) = view.camera.sees(place(index)) else { return };
            let Some(colour) = texel(&photo, pixel) else { return };
            *past += usize::from(!covered.is_covered(&view.camera, pixel));
            colours.push(colour);
        });
    }
    let point = |(index, (past, colours)): (usize, (usize, Vec<[u8; 3]>))| {
        let seen = colours.len();
        let is_far = seen >= VIEWS_MIN && 2 * past > seen;
        is_far.then(|| Point { position: place(index), colour: median(colours) })
    };
    let spacing = radius * (2.0 * TAU / count as f64).sqrt();
    Ok((shown.into_iter().enumerate().filter_map(point).collect(), 0.5 * spacing))
}

fn median(colours: Vec<[u8; 3]>) -> [u8; 3] {
    [0, 1, 2].map(|channel| {
        let mut values: Vec<u8> = colours.iter().map(|colour| colour[channel]).collect();
        values.sort_unstable();
        values[values.len() / 2]
    })
}
