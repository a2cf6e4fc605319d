//! Convex hulls of the objects of a view.

use crate::scene::LabelMap;
use std::collections::BTreeMap;

type Point = (i64, i64);

/// The convex hull of an object's pixels and their mean.
pub(super) struct Outline {
    /// Corners, counter-clockwise for y up.
    hull: Vec<Point>,
    sum: Point,
    count: i64,
}

/// Returns twice the area of the triangle, positive for a left turn with y up.
fn area(a: Point, b: Point, c: Point) -> i64 {
    (b.0 - a.0) * (c.1 - a.1) - (b.1 - a.1) * (c.0 - a.0)
}

/// Returns half of the hull of points sorted in one direction (monotone chain, Andrew 1979), without its last point.
fn half(points: impl Iterator<Item = Point>) -> Vec<Point> {
    let mut hull: Vec<Point> = Vec::new();
    for point in points {
        while hull.len() > 1 && area(hull[hull.len() - 2], hull[hull.len() - 1], point) <= 0 {
            hull.pop();
        }
        hull.push(point);
    }
    hull.pop();
    hull
}

impl Outline {
    /// Returns the outlines of all objects, by id.
    pub(super) fn find_all(labels: &LabelMap) -> BTreeMap<u16, Self> {
        // The leftmost and rightmost pixels of the rows are enough for the hull.
        let mut rows: BTreeMap<u16, BTreeMap<i64, (i64, i64)>> = BTreeMap::new();
        let mut sums: BTreeMap<u16, (Point, i64)> = BTreeMap::new();
        for (index, &id) in labels.ids.iter().enumerate().filter(|&(_, &id)| id != 0) {
            let (x, y) = (index as i64 % i64::from(labels.width), index as i64 / i64::from(labels.width));
            let row = rows.entry(id).or_default().entry(y).or_insert((x, x));
            *row = (row.0.min(x), row.1.max(x));
            let (sum, count) = sums.entry(id).or_default();
            (*sum, *count) = ((sum.0 + x, sum.1 + y), *count + 1);
        }
        let outline = |(id, (sum, count)): (u16, (Point, i64))| {
            let ends = rows.remove(&id).unwrap_or_default().into_iter();
            let mut points: Vec<Point> = ends.flat_map(|(y, (left, right))| [(left, y), (right, y)]).collect();
            points.sort_unstable();
            points.dedup();
            let mut hull = half(points.iter().copied());
            hull.extend(half(points.iter().rev().copied()));
            (id, Self { hull, sum, count })
        };
        sums.into_iter().map(outline).collect()
    }

    /// Returns the pixel nearest to the mean of all pixels.
    pub(super) fn mean(&self) -> (i64, i64) {
        let round = |sum: i64| (2 * sum + self.count) / (2 * self.count);
        (round(self.sum.0), round(self.sum.1))
    }

    /// Returns true for a pixel in the hull or on its edge. A hull without area contains no pixel.
    pub(super) fn contains(&self, pixel: (i64, i64)) -> bool {
        let corners = self.hull.len();
        corners > 2 && (0..corners).all(|at| area(self.hull[at], self.hull[(at + 1) % corners], pixel) >= 0)
    }
}
