//! The region that a scene's cameras look at.

use super::Camera;
use super::principal::principal_axes;
use super::spread::quantiles;
use glam::{DMat3, DVec3};

/// Share of the positions at either end of each axis that is ignored when finding the up direction.
const OUTLIER_SHARE: f64 = 0.05;
/// A model is flat if its height is at most this multiple of its smaller width.
const FLAT_HEIGHT_MAX: f64 = 0.35;
/// Smallest cosine between a flat model's normal and COLMAP's up axis for that axis to decide which side is up.
const UP_COSINE_MIN: f64 = 0.5;
/// Smallest ratio of the heights above and below a flat model's centre for objects to be standing on it.
const STANDING_RATIO_MIN: f64 = 1.5;

/// A position and distance from which to look at a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Overview {
    /// Direction of up in the world, of length 1.
    pub up: DVec3,
    /// Centre of the region, world units.
    pub target: DVec3,
    /// Mean distance of the cameras from the centre, world units.
    pub distance: f64,
}

impl Overview {
    /// Returns the mean up direction of some cameras, the point that they look at, and their mean distance from it;
    /// `None` without cameras.
    pub fn from_cameras<'a>(cameras: impl Iterator<Item = &'a Camera> + Clone) -> Option<Self> {
        let count = cameras.clone().count();
        if count == 0 {
            return None;
        }
        let up = -cameras.clone().map(|camera| camera.rotation.row(1)).sum::<DVec3>();
        let middle = cameras.clone().map(Camera::centre).sum::<DVec3>() / count as f64;
        // Regularised towards the cameras, because their axes may be parallel.
        let (matrix, right) = nearest_to_axes(cameras.clone());
        let target = (matrix + DMat3::IDENTITY * 1e-3).inverse() * (right + middle * 1e-3);
        let distance = cameras.map(|camera| camera.centre().distance(target)).sum::<f64>() / count as f64;
        Some(Self { up: up.try_normalize().unwrap_or(DVec3::NEG_Y), target, distance: distance.max(1e-6) })
    }
}

/// Returns the likely unit up direction of positions without cameras. A flat model, such as terrain, a room or a table,
/// lies on its plane. Its upper side is the one near -y, which is up in most captures (COLMAP), or else the one on
/// which objects stand. A model that is not flat has up -y.
pub fn likely_up(positions: impl Iterator<Item = DVec3> + Clone) -> DVec3 {
    let [low, high] = quantiles(positions.clone(), [OUTLIER_SHARE, 1.0 - OUTLIER_SHARE]);
    let inside = positions.filter(|place| place.cmpge(low).all() && place.cmple(high).all());
    let count = inside.clone().count().max(1) as f64;
    let middle = inside.clone().sum::<DVec3>() / count;
    let outer = |v: DVec3| DMat3::from_cols(v * v.x, v * v.y, v * v.z);
    let covariance = inside.clone().fold(DMat3::ZERO, |sum, place| sum + outer(place - middle)) * count.recip();
    let (axes, sizes) = principal_axes(&covariance);
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| sizes[a].total_cmp(&sizes[b]));
    let normal = axes.col(order[0]);
    if sizes[order[0]] >= FLAT_HEIGHT_MAX * sizes[order[1]] {
        return DVec3::NEG_Y;
    }
    if normal.y.abs() >= UP_COSINE_MIN {
        return normal * -normal.y.signum();
    }
    let heights = inside.map(|place| DVec3::X * (place - middle).dot(normal));
    let [below, level, above] = quantiles(heights, [OUTLIER_SHARE, 0.5, 1.0 - OUTLIER_SHARE]).map(|height| height.x);
    match (above - level, level - below) {
        (above, below) if above > STANDING_RATIO_MIN * below => normal,
        (above, below) if below > STANDING_RATIO_MIN * above => -normal,
        _ => DVec3::NEG_Y,
    }
}

/// Returns the matrix and right-hand side of the linear system for the point with the smallest sum of squared distances
/// to the optical axes.
pub fn nearest_to_axes<'a>(cameras: impl Iterator<Item = &'a Camera>) -> (DMat3, DVec3) {
    let (mut matrix, mut right) = (DMat3::ZERO, DVec3::ZERO);
    for camera in cameras {
        let axis = camera.axis();
        let across = DMat3::IDENTITY - DMat3::from_cols(axis * axis.x, axis * axis.y, axis * axis.z);
        matrix += across;
        right += across * camera.centre();
    }
    (matrix, right)
}

#[cfg(test)]
mod tests {
    use super::likely_up;
    use glam::{DQuat, DVec3};

    /// A floor of 40 x 40 positions, y down, with a heap of them on it and some far away.
    fn floor() -> Vec<DVec3> {
        let grid = |i: u32| DVec3::new(f64::from(i % 40) - 20.0, 0.01 * f64::from(i % 7), f64::from(i / 40) - 20.0);
        let heap = |i: u32| DVec3::new(f64::from(i % 5), -0.05 * f64::from(i), f64::from(i % 3));
        let far = |i: u32| 500.0 * DVec3::new(f64::from(i).sin(), f64::from(i).cos(), 0.3);
        (0..1600).map(grid).chain((0..200).map(heap)).chain((0..20).map(far)).collect()
    }

    #[test]
    fn a_floor_lies_below_what_stands_on_it() {
        let turned = |turn: DQuat| likely_up(floor().iter().map(|&place| turn * place + DVec3::splat(7.0)));
        for angle in [0.0, 0.3, -0.6, 0.9] {
            let turn = DQuat::from_rotation_x(angle);
            assert!(turned(turn).dot(turn * DVec3::NEG_Y) > 0.999, "{} at {angle}", turned(turn));
        }
        // On its side, either way: the heap tells.
        for turn in [DQuat::from_rotation_x(1.57), DQuat::from_rotation_x(-1.57), DQuat::from_rotation_z(1.5)] {
            assert!(turned(turn).dot(turn * DVec3::NEG_Y) > 0.999, "{}", turned(turn));
        }
    }

    #[test]
    fn what_is_not_flat_stands_as_most_captures_do() {
        let ball = (0..500).map(|i| DVec3::new(f64::from(i).sin(), f64::from(3 * i).sin(), f64::from(7 * i).sin()));
        assert_eq!(likely_up(ball), DVec3::NEG_Y);
        let column = (0..500).map(|i| DVec3::new(0.1 * f64::from(i).sin(), f64::from(i), 0.1 * f64::from(i).cos()));
        assert_eq!(likely_up(column), DVec3::NEG_Y);
        assert_eq!(likely_up(std::iter::empty()), DVec3::NEG_Y);
        // A wall, from which nothing stands out.
        let wall = (0..900).map(|i| DVec3::new(f64::from(i % 30), f64::from(i / 30), 0.01 * f64::from(i % 3 - 1)));
        assert_eq!(likely_up(wall), DVec3::NEG_Y);
    }
}
