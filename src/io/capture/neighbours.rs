//! Which points each photo shows, and what it shares with others.

use super::{Fault, Finding, ViewReport};
use crate::io::colmap::Seen;
use crate::io::listing::Listed;
use crate::scene::{Point, View};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use std::collections::HashMap;

/// Fewest points that a photo has to share with two others.
const SHARED_MIN: usize = 20;
/// The same relative to the median over photos.
const SHARED_PART: f64 = 0.05;
/// Fewest points of a scene for this test.
const POINTS_MIN: usize = 200;

/// Returns the points that each view shows: index of the point, and its pixel. Observations of the reconstruction decide
/// where they exist; else a view shows all points in its picture.
pub(super) fn seen(
    views: &[&View],
    points: &[Point],
    observed: &[Option<&(Listed, Vec<Seen>)>],
) -> Vec<Vec<(usize, DVec2)>> {
    let key = |place: DVec3| place.to_array().map(f64::to_bits);
    let index: HashMap<[u64; 3], usize> =
        points.iter().enumerate().map(|(index, point)| (key(point.position), index)).collect();
    let of_view = |(view, observed): (&&View, &Option<&(Listed, Vec<Seen>)>)| {
        let camera = &view.camera;
        let inside = |index: usize| Some((index, camera.sees(points[index].position)?));
        match observed.filter(|(_, seen)| !seen.is_empty()) {
            Some((_, seen)) => seen.iter().filter_map(|(_, world)| inside(*index.get(&key(*world))?)).collect(),
            None => (0..points.len()).filter_map(inside).collect(),
        }
    };
    views.par_iter().zip(observed).map(of_view).collect()
}

/// Returns for each view the number of its points that at least two others show.
pub(super) fn shared(seen: &[Vec<(usize, DVec2)>], points: usize) -> Vec<usize> {
    let mut views = vec![0_u32; points];
    seen.iter().flatten().for_each(|&(index, _)| views[index] += 1);
    seen.iter().map(|of_view| of_view.iter().filter(|&&(index, _)| views[index] >= 3).count()).collect()
}

/// Finds photos that share hardly any point with others.
pub(super) fn findings(views: &[ViewReport], points: usize) -> Vec<Finding> {
    if points < POINTS_MIN {
        return Vec::new();
    }
    let mut sorted: Vec<usize> = views.iter().map(|view| view.shared).collect();
    sorted.sort_unstable();
    let usual = sorted[sorted.len() / 2];
    let least = SHARED_MIN.max((SHARED_PART * usual as f64) as usize);
    let odd = |view: &ViewReport| {
        let text = format!("shares {} points with two others, {usual} is usual: nothing confirms it", view.shared);
        (view.shared < least).then(|| Finding::new(Fault::Alone, Some(&view.name), text))
    };
    views.iter().filter_map(odd).collect()
}
