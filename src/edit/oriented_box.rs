//! Bounding boxes of objects along their own axes, robust to floaters.

use glam::{DMat3, DQuat, DVec3};
use labelgs_scene::median::median;
use labelgs_scene::principal::principal_axes;
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use serde::Serialize;
use std::collections::BTreeMap;

/// Most Gaussians measured per label, spread evenly through the model.
const SAMPLES_MAX: u64 = 2000;
/// Most of the measured Gaussians used in the search for axes.
const SEARCHED_MAX: usize = 300;
/// Share of the weight that lies within an object's radius.
const RADIUS_WEIGHT_SHARE: f64 = 0.8;
/// Distance from the centre, in radii, beyond which a Gaussian is a floater.
const FLOATER_RADII: f64 = 4.0;
/// Largest share of the weight that may stick out at each side.
const OUTSIDE_SHARE_MAX: f64 = 0.01;
/// Steps by which axes are turned to a smaller box, in degrees, and how many steps each way.
const TURN_STEPS: [(f64, i32); 2] = [(5.0, 9), (1.0, 4)];
/// Passes over the three axes per step size.
const TURN_PASSES: usize = 2;

/// A box along the axes of an object.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct OrientedBox {
    /// Centre, world units.
    pub centre: [f64; 3],
    /// Unit axes in the world, longest side first; right-handed.
    pub axes: [[f64; 3]; 3],
    /// Side lengths, world units, longest first.
    pub sizes: [f64; 3],
    /// Volume, cubic world units.
    pub volume: f64,
}

/// A measured Gaussian.
#[derive(Clone, Copy, Debug)]
struct Sample {
    mean: DVec3,
    weight: f64,
    /// Standard deviations, and the rotation to the world.
    sizes: DVec3,
    turn: DQuat,
}

impl Sample {
    /// Standard deviation along a direction.
    fn deviation(&self, axis: DVec3) -> f64 {
        (self.turn.inverse() * axis * self.sizes).length()
    }
}

/// Collects the Gaussians of each label, one at a time.
#[derive(Debug, Default)]
pub struct Boxes {
    /// Per label: the sampling stride, the number seen, and the samples.
    by_label: BTreeMap<u32, (u64, u64, Vec<Sample>)>,
}

impl Boxes {
    /// Starts with the number of Gaussians of each label.
    pub fn new(counts: &BTreeMap<u32, u64>) -> Self {
        let start = |(&label, &count): (&u32, &u64)| (label, (count / SAMPLES_MAX + 1, 0, Vec::new()));
        Self { by_label: counts.iter().map(start).collect() }
    }

    /// Adds a Gaussian: its label, its position in the world, its weight (such as opacity), its rotation (w, x, y, z)
    /// and the logarithms of its standard deviations.
    pub fn add(&mut self, label: u32, mean: DVec3, weight: f64, quat: [f64; 4], scale: [f32; 3]) {
        let Some((every, seen, samples)) = self.by_label.get_mut(&label) else { return };
        let is_kept = seen.is_multiple_of(*every);
        *seen += 1;
        let [w, x, y, z] = quat;
        let turn = DQuat::from_xyzw(x, y, z, w).normalize();
        if is_kept && weight > 0.0 && mean.is_finite() && turn.is_finite() {
            let sizes = DVec3::from_array(scale.map(|scale| f64::from(scale).exp()));
            samples.push(Sample { mean, weight, sizes, turn });
        }
    }

    /// Returns the box of each label with a positive weight.
    pub fn finish(self) -> BTreeMap<u32, OrientedBox> {
        self.by_label.into_par_iter().filter_map(|(label, (.., samples))| Some((label, measured(&samples)?))).collect()
    }
}

/// Returns the box of some Gaussians. It starts at their principal axes and turns to where the box is smallest. At each
/// side, all but a small share of the weight is inside; a Gaussian reaches one standard deviation to both sides.
fn measured(samples: &[Sample]) -> Option<OrientedBox> {
    let along = |axis: usize| median(samples.iter().map(move |sample| sample.mean[axis]));
    let middle = DVec3::new(along(0)?, along(1)?, along(2)?);
    let far = |sample: &Sample| sample.mean.distance(middle);
    let radius = quantile(samples.iter().map(|sample| (far(sample), sample.weight)).collect(), RADIUS_WEIGHT_SHARE)?;
    let samples: Vec<Sample> = samples.iter().copied().filter(|sample| far(sample) <= FLOATER_RADII * radius).collect();
    let weight: f64 = samples.iter().map(|sample| sample.weight).sum();
    let mean = samples.iter().map(|sample| sample.mean * sample.weight).sum::<DVec3>() / weight;
    let spread = |sample: &Sample| {
        let off = sample.mean - mean;
        DMat3::from_cols(off * off.x, off * off.y, off * off.z) * (sample.weight / weight)
    };
    let covariance = samples.iter().map(spread).fold(DMat3::ZERO, |sum, one| sum + one);
    let (axes, ..) = principal_axes(&covariance);
    let few: Vec<Sample> = samples.iter().step_by(samples.len() / SEARCHED_MAX + 1).copied().collect();
    let turned = turned_to_smallest(&few, axes).axes;
    let [own, turned] = [axes, turned].map(|axes| Sides::around(&samples, axes));
    Some(if turned.volume() < own.volume() { turned } else { own }.ordered())
}

/// A box with unordered axes: the columns of its rotation, and the ends along each.
#[derive(Clone, Copy)]
struct Sides {
    axes: DMat3,
    low: DVec3,
    high: DVec3,
}

impl Sides {
    fn around(samples: &[Sample], axes: DMat3) -> Self {
        let (mut low, mut high) = (DVec3::ZERO, DVec3::ZERO);
        for index in 0..3 {
            let axis = axes.col(index);
            let end = |sign: f64, share: f64| {
                let at = |sample: &Sample| sample.mean.dot(axis) + sign * sample.deviation(axis);
                quantile(samples.iter().map(|sample| (at(sample), sample.weight)).collect(), share).unwrap_or(0.0)
            };
            (low[index], high[index]) = (end(-1.0, OUTSIDE_SHARE_MAX), end(1.0, 1.0 - OUTSIDE_SHARE_MAX));
        }
        Self { axes, low, high }
    }

    fn volume(&self) -> f64 {
        (self.high - self.low).element_product()
    }

    fn ordered(&self) -> OrientedBox {
        let sizes = self.high - self.low;
        let mut order = [0, 1, 2];
        order.sort_by(|&a, &b| sizes[b].total_cmp(&sizes[a]));
        // Of an axis's two directions, choose the one whose largest component is positive.
        let direction = |index: usize| {
            let axis = self.axes.col(order[index]);
            axis * axis[axis.abs().max_position()].signum()
        };
        let (first, second) = (direction(0), direction(1));
        let axes = [first, second, first.cross(second)].map(|axis| axis.to_array());
        let sizes = order.map(|index| sizes[index]);
        let centre = (self.axes * (0.5 * (self.low + self.high))).to_array();
        OrientedBox { centre, axes, sizes, volume: self.volume() }
    }
}

/// Turns a box about each axis to where it is smallest, because a cube has no unique principal axes.
fn turned_to_smallest(samples: &[Sample], axes: DMat3) -> Sides {
    let mut best = Sides::around(samples, axes);
    for (degrees, reach) in TURN_STEPS {
        for _ in 0..TURN_PASSES {
            let before = best.volume();
            for index in 0..3 {
                let start = best.axes;
                for step in (-reach..=reach).filter(|&step| step != 0) {
                    let turn = DMat3::from_axis_angle(start.col(index), (f64::from(step) * degrees).to_radians());
                    let found = Sides::around(samples, turn * start);
                    if found.volume() < best.volume() {
                        best = found;
                    }
                }
            }
            if best.volume() >= before {
                break;
            }
        }
    }
    best
}

/// Returns the value below which a share of the weight lies, or `None` if the total weight is 0.
fn quantile(mut values: Vec<(f64, f64)>, share: f64) -> Option<f64> {
    values.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let wanted = share * values.iter().map(|value| value.1).sum::<f64>();
    let mut sum = 0.0;
    let found = values.iter().find(|value| {
        sum += value.1;
        sum >= wanted
    });
    found.or(values.last()).map(|value| value.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points on the surface of a box, turned, with some far away.
    fn cloud(sizes: DVec3, turn: DQuat, floaters: usize) -> OrientedBox {
        let steps = 14;
        let mut boxes = Boxes::new(&BTreeMap::from([(3, 9999)]));
        // Keep all: the count is only a guess of the caller.
        boxes.by_label.values_mut().for_each(|of| of.0 = 1);
        let place = |step: usize| step as f64 / (steps - 1) as f64 - 0.5;
        for index in 0..steps * steps * steps {
            let at = [index % steps, index / steps % steps, index / steps / steps];
            if at.iter().any(|&step| step == 0 || step == steps - 1) {
                let mean = turn * (DVec3::from_array(at.map(place)) * sizes) + DVec3::new(5.0, -2.0, 1.0);
                boxes.add(3, mean, 0.9, [1.0, 0.0, 0.0, 0.0], [-9.0; 3]);
            }
        }
        for index in 0..floaters {
            let far = DVec3::new((index as f64).sin(), (index as f64 * 1.7).cos(), 0.4) * (10.0 + index as f64);
            boxes.add(3, far, 0.4, [1.0, 0.0, 0.0, 0.0], [0.0; 3]);
        }
        boxes.finish()[&3]
    }

    #[test]
    fn a_turned_box_is_measured_among_floaters() {
        let turn = DQuat::from_euler(glam::EulerRot::XYZ, 0.7, -0.4, 1.1);
        for (sizes, floaters) in
            [([3.0, 2.0, 1.0], 0), ([3.0, 2.0, 1.0], 40), ([1.5, 1.5, 1.5], 40), ([4.0, 0.3, 0.2], 10)]
        {
            let found = cloud(sizes.into(), turn, floaters);
            for (size, truth) in found.sizes.iter().zip(sizes) {
                assert!((size - truth).abs() < 0.04 * truth, "{sizes:?}: {found:?}");
            }
            assert!(DVec3::from(found.centre).distance(DVec3::new(5.0, -2.0, 1.0)) < 0.02 * sizes[0], "{found:?}");
            assert!((found.volume - found.sizes.iter().product::<f64>()).abs() < 1e-9 * found.volume);
            let [a, b, c] = found.axes.map(DVec3::from);
            assert!(a.cross(b).distance(c) < 1e-9 && a.dot(b).abs() < 1e-9, "{found:?}");
            // Each side of the truth has its axis.
            for side in [DVec3::X, DVec3::Y, DVec3::Z] {
                let best = [a, b, c].map(|axis| axis.dot(turn * side).abs()).into_iter().fold(0.0, f64::max);
                assert!(best > 0.999, "{sizes:?}: {best} {found:?}");
            }
        }
    }

    #[test]
    fn gaussians_count_with_their_size() {
        let mut boxes = Boxes::new(&BTreeMap::from([(1, 1), (2, 1), (7, 0)]));
        // Its long axis, x, is turned to y.
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let (long, short) = (2_f32.ln(), 0.1_f32.ln());
        boxes.add(1, DVec3::ONE, 1.0, [half, 0.0, 0.0, half], [long, short, short]);
        boxes.add(2, DVec3::ONE, 0.0, [1.0, 0.0, 0.0, 0.0], [0.0; 3]);
        let found = boxes.finish();
        assert_eq!(found.keys().collect::<Vec<_>>(), [&1], "the others have no weight");
        let OrientedBox { sizes, axes, .. } = found[&1];
        assert!((sizes[0] - 4.0).abs() < 1e-3 && (sizes[1] - 0.2).abs() < 1e-3, "{sizes:?}");
        assert!(axes[0][1] > 0.999, "{axes:?}");
    }
}
