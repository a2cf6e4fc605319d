//! Where most of a scene's positions lie, robust to outliers.

use super::median::median;
use glam::DVec3;

/// Share of the positions within the radius.
const SHARE_WITHIN: f64 = 0.8;
/// Fewest positions among which one can be an outlier.
const COUNT_MIN: usize = 5;

/// The centre of most positions, and how far they are from it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// Medians of the coordinates.
    pub middle: DVec3,
    /// Distance from the centre within which `SHARE_WITHIN` of the positions lie.
    pub radius: f64,
}

impl Spread {
    /// Measures positions; `None` if there are too few or all coincide.
    pub fn measure(positions: impl Iterator<Item = DVec3> + Clone) -> Option<Self> {
        let along = |axis: usize| median(positions.clone().map(move |position| position[axis]));
        let middle = DVec3::new(along(0)?, along(1)?, along(2)?);
        let mut distances: Vec<f64> = positions.map(|position| position.distance(middle)).collect();
        if distances.len() < COUNT_MIN {
            return None;
        }
        let within = (SHARE_WITHIN * (distances.len() - 1) as f64) as usize;
        let radius = *distances.select_nth_unstable_by(within, f64::total_cmp).1;
        (radius > 1e-9 * middle.length().max(1.0)).then_some(Self { middle, radius })
    }

    /// Returns the distance from the centre, in radii.
    pub fn distance(&self, position: DVec3) -> f64 {
        position.distance(self.middle) / self.radius
    }
}

/// Returns the quantiles of the finite coordinates per axis; 0 if there are none.
pub fn quantiles<const N: usize>(positions: impl Iterator<Item = DVec3> + Clone, shares: [f64; N]) -> [DVec3; N] {
    let along = |axis: usize| {
        let mut values: Vec<f64> = positions.clone().map(|place| place[axis]).filter(|v| v.is_finite()).collect();
        values.sort_unstable_by(f64::total_cmp);
        let last = values.len().saturating_sub(1) as f64;
        shares.map(|share| values.get((last * share).round() as usize).copied().unwrap_or(0.0))
    };
    let axes = [along(0), along(1), along(2)];
    std::array::from_fn(|at| DVec3::from_array([0, 1, 2].map(|axis| axes[axis][at])))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_each_axis() {
        let line = (0..=100).map(|i| DVec3::new(f64::from(i), -f64::from(i), if i == 3 { f64::NAN } else { 7.0 }));
        let expected = [DVec3::new(10.0, -90.0, 7.0), DVec3::new(50.0, -50.0, 7.0)];
        assert_eq!(quantiles(line, [0.1, 0.5]), expected);
        assert_eq!(quantiles(std::iter::empty(), [0.5]), [DVec3::ZERO]);
    }

    #[test]
    fn stray_positions_move_nothing() {
        let ring = (0..12).map(|i| DVec3::new(f64::from(i).cos(), f64::from(i).sin(), 0.0));
        let usual = Spread::measure(ring.clone()).expect("a spread");
        for far in [1e3, 1e9] {
            let found = Spread::measure(ring.clone().chain([DVec3::new(far, -far, far)])).expect("a spread");
            assert!(found.middle.distance(usual.middle) < 0.5, "{found:?}");
            assert!(found.radius < 1.5 && found.distance(DVec3::splat(far)) > 100.0, "{found:?}");
        }
        assert_eq!(Spread::measure(ring.take(4)), None, "too few");
        assert_eq!(Spread::measure([DVec3::ONE; 9].into_iter()), None, "all at one place");
    }
}
