//! Directions distributed over the sphere.

use glam::DVec3;
use std::f64::consts::TAU;

/// Returns one of `count` approximately evenly distributed unit vectors: a Fibonacci lattice.
pub fn even_direction(index: usize, count: usize) -> DVec3 {
    let height = 1.0 - (2.0 * index as f64 + 1.0) / count as f64;
    let (angle, width) = (TAU * index as f64 * 0.618_033_988_749_894_8, (1.0 - height * height).sqrt());
    DVec3::new(width * angle.cos(), height, width * angle.sin())
}
