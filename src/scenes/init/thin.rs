//! Reduces the number of points and preserves their distribution.

use glam::DVec3;
use labelgs_scene::Point;
use rayon::prelude::*;

/// Bits per axis of a position on the curve.
const CURVE_BITS: u32 = 21;

/// Returns at most `count` of the points in their order, at equal intervals along a space-filling curve through all
/// points. Dense regions stay denser than others, and no region loses all its points.
pub fn thinned(points: &[Point], count: usize) -> Vec<Point> {
    if points.len() <= count {
        return points.to_vec();
    }
    let (mut low, mut high) = (DVec3::MAX, DVec3::MIN);
    points.iter().for_each(|point| (low, high) = (low.min(point.position), high.max(point.position)));
    let cells = f64::from((1_u32 << CURVE_BITS) - 1) / (high - low).max_element().max(f64::MIN_POSITIVE);
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

/// Interleaves the bits of three cells, lowest first.
fn interleaved(cells: [u64; 3]) -> u64 {
    let bit = |axis: usize, bit: u32| (cells[axis] >> bit & 1) << (3 * bit + axis as u32);
    (0..CURVE_BITS).map(|of| bit(0, of) | bit(1, of) | bit(2, of)).fold(0, |all, bits| all | bits)
}
