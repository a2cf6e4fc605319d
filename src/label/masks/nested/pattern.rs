//! Detects tiles, planks and stripes: pieces of one sheet, which are not objects.

use super::group::{Group, Scene};
use crate::scene::principal::principal_axes;
use glam::{DMat3, DVec3};

/// Largest ratio of thickness to width of a flat group.
const FLAT_MAX: f64 = 0.35;
/// Largest distance of a flat group's centre from another's plane, in sizes, for both to be coplanar.
const COPLANAR_SIZES_MAX: f64 = 0.1;
/// Smallest cosine of the angle between coplanar groups' normals (20 degrees).
const PARALLEL_MIN: f64 = 0.94;
/// Largest ratio of the sizes of two pieces of one pattern.
const SIZE_RATIO_MAX: f64 = 3.0;
/// Fewest similar coplanar pieces for a group to be a tile.
const LIKE_MIN: usize = 5;
/// Fewest tiles of a pattern.
const TILES_MIN: usize = 8;
/// Smallest share of a group within `NEAR_SIZES` of a tile's plane for the group to be a tile too.
const LYING_SHARE_MIN: f64 = 0.7;
/// Largest distance from the plane for that, in sizes.
const NEAR_SIZES: f64 = 0.4;
/// Largest distance from the tile for that, in sizes.
const REACH_SIZES: f64 = 20.0;
/// Largest share that two tiles may have in common.
const SHARED_MAX: f64 = 0.3;
/// Distance from a group's centre, in medians, beyond which Gaussians are ignored as outliers.
const STRAY_MEDIANS: f64 = 3.0;

/// A group as a planar piece.
struct Piece {
    middle: DVec3,
    normal: DVec3,
    is_flat: bool,
    /// Geometric mean of its two larger deviations, world units.
    size: f64,
}

impl Piece {
    fn from_group(scene: &Scene, group: &Group, means: &[[f32; 3]]) -> Self {
        let points = || {
            let point =
                |&row: &u32| (DVec3::from_array(means[row as usize].map(f64::from)), scene.weights[row as usize]);
            group.rows.iter().map(point)
        };
        let middle = points().map(|(point, weight)| point * weight).sum::<DVec3>() / group.area;
        let mut distances: Vec<f64> = points().map(|(point, _)| point.distance(middle)).collect();
        let half = distances.len() / 2;
        let reach = STRAY_MEDIANS * *distances.select_nth_unstable_by(half, f64::total_cmp).1;
        let (mut covariance, mut total) = (DMat3::ZERO, 0.0);
        for (point, weight) in points().filter(|(point, _)| point.distance(middle) <= reach) {
            let away = point - middle;
            covariance += DMat3::from_cols(away * away.x, away * away.y, away * away.z) * weight;
            total += weight;
        }
        let (axes, sizes) = principal_axes(&(covariance * (1.0 / total.max(f64::MIN_POSITIVE))));
        let mut by_size: [usize; 3] = [0, 1, 2];
        by_size.sort_by(|&a, &b| sizes[a].total_cmp(&sizes[b]));
        let [thin, middle_size, large] = by_size.map(|axis| sizes[axis]);
        Self {
            middle,
            normal: axes.col(by_size[0]),
            is_flat: thin <= FLAT_MAX * middle_size,
            size: (middle_size * large).sqrt().max(f64::MIN_POSITIVE),
        }
    }

    fn is_like(&self, other: &Self) -> bool {
        let ratio = self.size / other.size;
        let apart = self.normal.dot(other.middle - self.middle).abs();
        other.is_flat
            && (1.0 / SIZE_RATIO_MAX..=SIZE_RATIO_MAX).contains(&ratio)
            && self.normal.dot(other.normal).abs() >= PARALLEL_MIN
            && apart <= COPLANAR_SIZES_MAX * self.size.max(other.size)
    }
}

/// Drops groups that are pieces of patterns. `means` are the positions of the Gaussians.
pub(super) fn without_patterns(scene: &Scene, groups: Vec<Group>, means: &[[f32; 3]]) -> Vec<Group> {
    let pieces: Vec<Piece> = groups.iter().map(|group| Piece::from_group(scene, group, means)).collect();
    let shared = scene.shared(&groups);
    let overlap = |a: usize, b: usize| {
        let both = shared.get(&(a.min(b), a.max(b))).copied().unwrap_or(0.0);
        both > SHARED_MAX * groups[a].area.min(groups[b].area)
    };
    let alike = |at: usize| {
        let others = pieces.iter().enumerate().filter(|&(other, _)| other != at && !overlap(at, other));
        others.filter(|(_, piece)| pieces[at].is_like(piece)).count()
    };
    let tiles: Vec<usize> = (0..pieces.len()).filter(|&at| pieces[at].is_flat && alike(at) >= LIKE_MIN).collect();
    if tiles.len() < TILES_MIN {
        return groups;
    }
    let lies = |group: &Group, piece: &Piece| {
        tiles.iter().map(|&tile| &pieces[tile]).any(|tile| {
            let near = tile.middle.distance(piece.middle) <= REACH_SIZES * tile.size;
            let inside = |row: u32| {
                let point = DVec3::from_array(means[row as usize].map(f64::from));
                (point - tile.middle).dot(tile.normal).abs() < NEAR_SIZES * tile.size
            };
            let weight = |rows: &mut dyn Iterator<Item = u32>| rows.map(|row| scene.weights[row as usize]).sum::<f64>();
            near && piece.size <= SIZE_RATIO_MAX * tile.size
                && weight(&mut group.rows.iter().copied().filter(|&row| inside(row))) >= LYING_SHARE_MIN * group.area
        })
    };
    let keeps: Vec<bool> =
        (0..groups.len()).map(|at| !tiles.contains(&at) && !lies(&groups[at], &pieces[at])).collect();
    groups.into_iter().zip(keeps).filter(|(_, keeps)| *keeps).map(|(group, _)| group).collect()
}
