//! Merges two Gaussians into one.

use glam::{DMat3, DQuat, DVec3};
use labelgs_scene::gaussians::{ALPHA_MAX, axes_of};
use labelgs_scene::harmonics::SH_C0;
use labelgs_scene::principal::principal_axes;

/// Weight of a colour difference (0 to 1 per channel) relative to shape and position.
const COLOUR_WEIGHT: f64 = 4.0;
/// Smallest opacity of a merged Gaussian, so that it has a finite logit. The largest is where blending stops.
const OPACITY_MIN: f64 = 1e-6;

/// A Gaussian as moments.
#[derive(Clone, Debug)]
pub(super) struct Blob {
    pub mean: DVec3,
    pub covariance: DMat3,
    /// After the sigmoid.
    pub opacity: f64,
    /// Blending weight over all pixels of the views.
    pub weight: f64,
    pub label: u32,
    pub confidence: f32,
    /// Coefficients of degree 0, then the higher ones.
    pub harmonics: Vec<[f32; 3]>,
    /// The original row, if this is not a merged Gaussian.
    pub row: Option<usize>,
}

impl Blob {
    /// Returns the cost of merging to the renders: the smaller weight times the difference. Shape and position differ
    /// by the Bhattacharyya distance.
    pub(super) fn cost(&self, other: &Self) -> f64 {
        let mean = (self.covariance + other.covariance) * 0.5;
        let (gap, product) = (self.mean - other.mean, self.covariance.determinant() * other.covariance.determinant());
        let place = gap.dot(mean.inverse() * gap) / 8.0;
        let shape = 0.5 * (mean.determinant() / product.max(f64::MIN_POSITIVE).sqrt()).max(1.0).ln();
        let colour = self.colour().distance_squared(other.colour());
        let weight = self.weight * other.weight / (self.weight + other.weight).max(f64::MIN_POSITIVE);
        let cost = weight * (place + shape + COLOUR_WEIGHT * colour);
        // Keep flat Gaussians that are too thin to invert.
        if cost.is_finite() { cost } else { f64::INFINITY }
    }

    /// Merges two Gaussians: moments and colours by weight. The opacity preserves what both cover, as far as it is
    /// visible.
    pub(super) fn merged(&self, other: &Self) -> Self {
        let share = if self.weight + other.weight > 0.0 { self.weight / (self.weight + other.weight) } else { 0.5 };
        let mix = |a: f64, b: f64| share * a + (1.0 - share) * b;
        let mean = self.mean * share + other.mean * (1.0 - share);
        let spread = |blob: &Self| {
            let gap = blob.mean - mean;
            blob.covariance + DMat3::from_cols(gap * gap.x, gap * gap.y, gap * gap.z)
        };
        let covariance = spread(self) * share + spread(other) * (1.0 - share);
        let area = |covariance: &DMat3| {
            let (_, mut sizes) = axes(covariance);
            sizes.sort_by(f64::total_cmp);
            sizes[1] * sizes[2]
        };
        // Ignore cover that the views do not see: compare the share of this one's cover that they see with the other's.
        let covers = [self, other].map(|blob| blob.opacity * area(&blob.covariance));
        let seen = [self, other].map(|blob| blob.weight);
        let visible = (0..2).map(|at| seen[at] / covers[at].max(f64::MIN_POSITIVE)).fold(0.0, f64::max);
        let cover = if visible > 0.0 { (seen[0] + seen[1]) / visible } else { covers[0] + covers[1] };
        let opacity = cover / area(&covariance).max(f64::MIN_POSITIVE);
        let harmonics = self.harmonics.iter().zip(&other.harmonics);
        let harmonics = harmonics.map(|(a, b)| [0, 1, 2].map(|c| mix(f64::from(a[c]), f64::from(b[c])) as f32));
        Self {
            mean,
            covariance,
            opacity: opacity.clamp(OPACITY_MIN, ALPHA_MAX),
            weight: self.weight + other.weight,
            label: self.label,
            confidence: mix(self.confidence.into(), other.confidence.into()) as f32,
            harmonics: harmonics.collect(),
            row: None,
        }
    }

    fn colour(&self) -> DVec3 {
        let [r, g, b] = self.harmonics[0].map(|value| f64::from(value) * SH_C0);
        DVec3::new(r, g, b)
    }
}

/// Returns the covariance of a rotation (w, x, y, z) and the logarithms of deviations.
pub(super) fn covariance(quat: [f32; 4], scales: [f32; 3]) -> DMat3 {
    let turn = axes_of(quat);
    let squares = DVec3::from_array(scales.map(|scale| (2.0 * f64::from(scale)).exp()));
    turn * DMat3::from_diagonal(squares) * turn.transpose()
}

/// Returns the rotation of a covariance and the standard deviations along its axes.
pub(super) fn axes(covariance: &DMat3) -> (DQuat, [f64; 3]) {
    let (turn, sizes) = principal_axes(covariance);
    (DQuat::from_mat3(&turn).normalize(), sizes)
}

#[cfg(test)]
mod tests {
    use super::{Blob, axes, covariance};
    use glam::{DMat3, DVec3};

    fn blob(x: f64, weight: f64) -> Blob {
        let covariance = covariance([0.9, 0.1, -0.3, 0.2], [-1.0, -2.0, -3.0]);
        let harmonics = vec![[x as f32, 0.5, 0.0], [0.1; 3]];
        Blob { mean: DVec3::X * x, covariance, opacity: 0.6, weight, label: 3, confidence: 0.5, harmonics, row: None }
    }

    #[test]
    fn axes_give_the_covariance_back() {
        let matrix = covariance([0.3, -0.8, 0.2, 0.4], [0.5, -4.0, -1.0]);
        let (turn, sizes) = axes(&matrix);
        let turn = DMat3::from_quat(turn);
        let again = turn * DMat3::from_diagonal(DVec3::from_array(sizes.map(|size| size * size))) * turn.transpose();
        assert!((again - matrix).to_cols_array().iter().all(|gap| gap.abs() < 1e-12), "{again} {matrix}");
        let mut sorted = sizes;
        sorted.sort_by(f64::total_cmp);
        for (size, scale) in sorted.iter().zip([-4.0_f64, -1.0, 0.5]) {
            assert!((size.ln() - scale).abs() < 1e-9, "{sizes:?}");
        }
    }

    #[test]
    fn a_pair_has_the_moments_of_both() {
        let (a, b) = (blob(0.0, 1.0), blob(1.0, 3.0));
        let both = a.merged(&b);
        assert!((both.mean.x - 0.75).abs() < 1e-12 && both.weight == 4.0);
        // Variance of two points at 0 and 1 with shares of 1/4 and 3/4.
        assert!((both.covariance.x_axis.x - a.covariance.x_axis.x - 0.1875).abs() < 1e-12);
        assert_eq!(both.harmonics, [[0.75, 0.5, 0.0], [0.1; 3]]);
    }

    #[test]
    fn equal_ones_in_one_place_cover_twice_and_hidden_ones_nothing() {
        let twice = blob(0.0, 1.0).merged(&blob(0.0, 1.0));
        assert!((twice.opacity - 0.99).abs() < 1e-12, "{}", twice.opacity);
        let hidden = blob(0.0, 1.0).merged(&blob(5.0, 0.0));
        assert!((hidden.opacity - 0.6).abs() < 1e-12 && hidden.mean.x == 0.0);
        assert_eq!(blob(0.0, 1.0).cost(&blob(5.0, 0.0)), 0.0);
    }
}
