//! Fewer points, spread as all of them are.

use glam::DVec3;
use labelgs_scene::Point;
use rayon::prelude::*;

/// Bits of an axis in a place on the curve.
const BITS: u32 = 21;

/// Returns at most `count` of the points, in their order. They lie at even distances along a curve that goes through all points,
/// from each to a near one: dense places stay denser than others, and no place loses all its points.
pub fn thinned(points: &[Point], count: usize) -> Vec<Point> {
    if points.len() <= count {
        return points.to_vec();
    }
    let (mut low, mut high) = (DVec3::MAX, DVec3::MIN);
    points.iter().for_each(|point| (low, high) = (low.min(point.position), high.max(point.position)));
    let cells = f64::from((1_u32 << BITS) - 1) / (high - low).max_element().max(f64::MIN_POSITIVE);
    let code = |(index, point): (usize, &Point)| {
        let cell = (point.position - low) * cells;
        (interleaved(cell.to_array().map(|cell| cell as u64)), index)
    };
    let mut order: Vec<(u64, usize)> = points.par_iter().enumerate().map(code).collect();
    order.par_sort_unstable();
    let at = |place: usize| order[(place as u128 * order.len() as u128 / count as u128) as usize].1;
    let mut kept: Vec<usize> = (0..count).map(at).collect();
    kept.sort_unstable();
    kept.into_iter().map(|index| points[index]).collect()
}

/// Returns the bits of three cells in turns, from the lowest on.
fn interleaved(cells: [u64; 3]) -> u64 {
    let bit = |axis: usize, bit: u32| (cells[axis] >> bit & 1) << (3 * bit + axis as u32);
    (0..BITS).map(|of| bit(0, of) | bit(1, of) | bit(2, of)).fold(0, |all, bits| all | bits)
}
