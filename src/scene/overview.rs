//! What the cameras of a scene look at together.

use super::Camera;
use super::principal::principal_axes;
use super::spread::quantiles;
use glam::{DMat3, DVec3};

/// Share of the positions, along each axis from either end, that says nothing about the way up.
const OUTSIDE: f64 = 0.05;
/// Largest height of a flat model, in its smaller width.
const FLAT: f64 = 0.35;
/// Least cosine between the normal of a flat model and the upward axis of COLMAP at which this one tells up from down.
const UPRIGHT: f64 = 0.5;
/// Least ratio of the heights above and below the middle of a flat model at which things stand on it.
const STANDING: f64 = 1.5;

/// Where to look at a scene from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Overview {
    /// Direction of up in the world, of length 1.
    pub up: DVec3,
    /// The point in the middle, world units.
    pub target: DVec3,
    /// Distance of the cameras from it, world units.
    pub distance: f64,
}

impl Overview {
    /// Returns the mean up of some cameras, the point that they look at, and their mean distance from it; none without
    /// cameras.
    pub fn of<'a>(cameras: impl Iterator<Item = &'a Camera> + Clone) -> Option<Self> {
        let count = cameras.clone().count();
        if count == 0 {
            return None;
        }
        let up = -cameras.clone().map(|camera| camera.rotation.row(1)).sum::<DVec3>();
        let middle = cameras.clone().map(Camera::centre).sum::<DVec3>() / count as f64;
        // Held near the cameras where their axes are parallel.
        let (matrix, right) = nearest_to_axes(cameras.clone());
        let target = (matrix + DMat3::IDENTITY * 1e-3).inverse() * (right + middle * 1e-3);
        let distance = cameras.map(|camera| camera.centre().distance(target)).sum::<f64>() / count as f64;
        Some(Self { up: up.try_normalize().unwrap_or(DVec3::NEG_Y), target, distance: distance.max(1e-6) })
    }
}

/// Returns the likely way up of positions without cameras, of length 1. A model that is flat, as land, a room or a table are, lies
/// on its plane; its upper side is the one near -y, which points up in most captures (COLMAP), or the one to which
/// things stand out. A model that is not flat has -y.
pub fn likely_up(positions: impl Iterator<Item = DVec3> + Clone) -> DVec3 {
    let [low, high] = quantiles(positions.clone(), [OUTSIDE, 1.0 - OUTSIDE]);
    let inside = positions.filter(|place| place.cmpge(low).all() && place.cmple(high).all());
    let count = inside.clone().count().max(1) as f64;
    let middle = inside.clone().sum::<DVec3>() / count;
    let outer = |v: DVec3| DMat3::from_cols(v * v.x, v * v.y, v * v.z);
    let covariance = inside.clone().fold(DMat3::ZERO, |sum, place| sum + outer(place - middle)) * count.recip();
    let (axes, sizes) = principal_axes(&covariance);
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| sizes[a].total_cmp(&sizes[b]));
    let normal = axes.col(order[0]);
    if sizes[order[0]] >= FLAT * sizes[order[1]] {
        return DVec3::NEG_Y;
    }
    if normal.y.abs() >= UPRIGHT {
        return normal * -normal.y.signum();
    }
    let heights = inside.map(|place| DVec3::X * (place - middle).dot(normal));
    let [below, level, above] = quantiles(heights, [OUTSIDE, 0.5, 1.0 - OUTSIDE]).map(|height| height.x);
    match (above - level, level - below) {
        (above, below) if above > STANDING * below => normal,
        (above, below) if below > STANDING * above => -normal,
        _ => DVec3::NEG_Y,
    }
}

/// Returns matrix and right side of the equations for the point with the least sum of squared distances to the optical axes.
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
