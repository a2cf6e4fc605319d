//! Principal axes of a point cloud.

use glam::{DMat3, DVec3};

/// Sweeps of the eigenvalue iteration; five reach double precision for a 3 x 3 matrix.
const JACOBI_SWEEPS: usize = 8;

/// Returns the rotation whose columns are the principal axes of a covariance, and the standard deviations along them.
/// Uses Jacobi's method.
pub fn principal_axes(covariance: &DMat3) -> (DMat3, [f64; 3]) {
    let (mut matrix, mut turn) = (*covariance, DMat3::IDENTITY);
    for _ in 0..JACOBI_SWEEPS {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            let off = matrix.col(q)[p];
            if off == 0.0 {
                continue;
            }
            let ratio = (matrix.col(q)[q] - matrix.col(p)[p]) / (2.0 * off);
            let tangent = ratio.signum() / (ratio.abs() + ratio.hypot(1.0));
            let cosine = 1.0 / tangent.hypot(1.0);
            let mut step = DMat3::IDENTITY;
            *step.col_mut(p) = DVec3::ZERO;
            *step.col_mut(q) = DVec3::ZERO;
            (step.col_mut(p)[p], step.col_mut(p)[q]) = (cosine, -tangent * cosine);
            (step.col_mut(q)[p], step.col_mut(q)[q]) = (tangent * cosine, cosine);
            matrix = step.transpose() * matrix * step;
            turn *= step;
        }
    }
    let sizes = [0, 1, 2].map(|axis| matrix.col(axis)[axis].max(0.0).sqrt());
    (turn, sizes)
}
