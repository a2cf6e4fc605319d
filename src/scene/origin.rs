//! Origins for faraway scenes, such as in UTM coordinates: f32 positions are relative to a point near the scene's
//! centre.

use super::median::median;
use glam::DVec3;

/// A scene is far if its distance from the origin exceeds its size by this factor. At this factor, f32 rounds positions
/// to 1.5e-5 of the scene size, a hundredth of a pixel; farther away, the error soon reaches pixels.
const FAR_RATIO: f64 = 256.0;
/// Size of a scene with a single position, world units.
const SIZE_OF_A_POINT: f64 = 10.0;

/// Returns the best origin for positions: 0 unless the scene is far. Its coordinates are multiples of a power of two
/// above the size of the scene, so that the subtraction loses little precision.
pub fn far_origin<P: Copy + Into<DVec3>>(positions: &[P]) -> DVec3 {
    if positions.is_empty() {
        return DVec3::ZERO;
    }
    let along = |axis: usize| positions.iter().map(move |&position| position.into()[axis]);
    // Medians, because outliers may be anywhere.
    let middle = by_axis(|axis| median(along(axis)).unwrap_or(0.0));
    let size = by_axis(|axis| median(along(axis).map(|value| (value - middle[axis]).abs())).unwrap_or(0.0)).length();
    // Coinciding positions have no size.
    let size = if size > 0.0 { size } else { SIZE_OF_A_POINT };
    if !(middle.length() > FAR_RATIO * size) || !middle.is_finite() {
        return DVec3::ZERO;
    }
    let grid = (4.0 * size).log2().ceil().exp2();
    (middle / grid).round() * grid
}

fn by_axis(value: impl Fn(usize) -> f64) -> DVec3 {
    DVec3::new(value(0), value(1), value(2))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cloud(centre: DVec3, size: f64) -> Vec<DVec3> {
        (0..200)
            .map(|i| centre + size * DVec3::new((i % 7) as f64 - 3.0, (i % 11) as f64 - 5.0, (i % 5) as f64))
            .collect()
    }

    #[test]
    fn near_scenes_stay_where_they_are() {
        assert_eq!(far_origin::<DVec3>(&[]), DVec3::ZERO);
        assert_eq!(far_origin(&[DVec3::ZERO]), DVec3::ZERO);
        assert_eq!(far_origin(&[DVec3::splat(300.1)]), DVec3::ZERO);
        assert_ne!(far_origin(&[DVec3::splat(5e6)]), DVec3::ZERO);
        for (centre, size) in [(1.0, 1.0), (100.0, 1.0), (1e6, 1e5), (0.0, 1e-3)] {
            assert_eq!(far_origin(&cloud(DVec3::splat(centre), size)), DVec3::ZERO, "{centre}, {size}");
        }
    }

    #[test]
    fn far_scenes_lose_nothing() {
        for size in [1e-3, 1.0, 300.0] {
            let mut cloud = cloud(DVec3::new(4.5e5, 5.4e6, 120.0), size);
            cloud.push(DVec3::ZERO);
            let origin = far_origin(&cloud);
            assert!(origin.distance(DVec3::new(4.5e5, 5.4e6, 120.0)) < 40.0 * size.max(1.0), "{origin}");
            for p in &cloud[..200] {
                let back = (*p - origin).as_vec3().as_dvec3() + origin;
                assert!(back.distance(*p) < 1e-5 * size + 2e-9, "{p}: {}", back.distance(*p));
            }
        }
    }
}
