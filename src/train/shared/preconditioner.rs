//! Preconditioner of a photo's pose (CamP, Park et al. 2023).
//!
//! Rotation and translation look similar in a photo, and translation along the axis hardly shows. Adam takes equal
//! steps in every trained number. The pose is therefore the product of a matrix and six trained numbers, each of which
//! moves the scene's points equally far in the photo, in independent ways.

use crate::scene::{Camera, Point};
use glam::DVec3;

/// A matrix over the six numbers of a pose: rotation, then translation.
pub(in crate::train) type Matrix = [[f64; 6]; 6];

/// Share of the diagonal that is added to the second moments. Steps of a number that hardly shows are at most its
/// inverse root longer.
const DAMPING_SHARE: f64 = 0.01;
/// Fewest points needed for the moments.
const POINTS_MIN: usize = 10;
/// Iterations of the root; each doubles the correct digits close to the solution.
const ROOT_ITERATIONS: usize = 40;

const IDENTITY: Matrix = {
    let mut one = [[0.0; 6]; 6];
    let mut k = 0;
    while k < 6 {
        one[k][k] = 1.0;
        k += 1;
    }
    one
};

/// Returns the preconditioner of a view: the inverse root of the second moments of point derivatives in the photo, in
/// focal lengths. `unit` is the unit of translation, world units. Views with few points get the identity.
pub(in crate::train) fn view_preconditioner(camera: &Camera, points: &[Point], unit: f64) -> Matrix {
    let seen: Vec<DVec3> =
        points.iter().filter(|point| camera.sees(point.position).is_some()).map(|p| p.position).collect();
    if seen.len() < POINTS_MIN {
        return IDENTITY;
    }
    let mut moments = [[0.0; 6]; 6];
    for &place in &seen {
        let p = camera.to_camera(place);
        // Derivatives of x / z and y / z by each number; a small rotation w moves p to p + w x p.
        let derivatives = [0, 1, 2, 3, 4, 5].map(|k| {
            let axis = DVec3::AXES[k % 3];
            let d = if k < 3 { axis.cross(p) } else { -unit * axis };
            [(d.x - p.x / p.z * d.z) / p.z, (d.y - p.y / p.z * d.z) / p.z]
        });
        for (row, a) in moments.iter_mut().zip(&derivatives) {
            for (sum, b) in row.iter_mut().zip(&derivatives) {
                *sum += (a[0] * b[0] + a[1] * b[1]) / seen.len() as f64;
            }
        }
    }
    (0..6).for_each(|k| moments[k][k] *= 1.0 + DAMPING_SHARE);
    inverse_root(&moments).unwrap_or(IDENTITY)
}

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    a.map(|row| [0, 1, 2, 3, 4, 5].map(|column| (0..6).map(|k| row[k] * b[k][column]).sum()))
}

/// Returns the symmetric inverse root of a symmetric positive matrix, by coupled Newton-Schulz iteration; `None` if it
/// does not exist.
fn inverse_root(matrix: &Matrix) -> Option<Matrix> {
    let size = matrix.as_flattened().iter().map(|value| value * value).sum::<f64>().sqrt();
    let (mut root, mut inverse) = (matrix.map(|row| row.map(|value| value / size)), IDENTITY);
    for _ in 0..ROOT_ITERATIONS {
        let mut step = product(&inverse, &root).map(|row| row.map(|value| -0.5 * value));
        (0..6).for_each(|k| step[k][k] += 1.5);
        (root, inverse) = (product(&root, &step), product(&step, &inverse));
    }
    let found = inverse.map(|row| row.map(|value| value / size.sqrt()));
    let is_found = found.as_flattened().iter().all(|value| value.is_finite());
    is_found.then_some(found)
}

#[cfg(test)]
mod tests {
    use super::{IDENTITY, Matrix, inverse_root, product, view_preconditioner};
    use crate::scene::{Camera, Point};
    use glam::{DMat3, DVec3};

    fn camera() -> Camera {
        let (rotation, translation) = (DMat3::from_rotation_y(0.3), DVec3::new(0.1, -0.2, 5.0));
        Camera { rotation, translation, fx: 90.0, fy: 90.0, cx: 50.0, cy: 40.0, width: 100, height: 80 }
    }

    fn points() -> Vec<Point> {
        let place = |k: usize| DVec3::new((k % 5) as f64 - 2.0, (k % 7) as f64 * 0.5 - 1.5, (k % 3) as f64 * 0.8 - 1.0);
        (0..60).map(|k| Point { position: place(k), colour: [0; 3] }).collect()
    }

    #[test]
    fn the_inverse_root_is_one() {
        let mut matrix: Matrix = [[0.0; 6]; 6];
        for (i, row) in matrix.iter_mut().enumerate() {
            for (j, value) in row.iter_mut().enumerate() {
                // Scales differ by a factor of a thousand, and are correlated.
                *value = 10_f64.powf(-0.3 * (i + j) as f64) * if i == j { 1.0 } else { 0.6 };
            }
        }
        let root = inverse_root(&matrix).expect("positive");
        let one = product(&product(&root, &matrix), &root);
        let error =
            one.as_flattened().iter().zip(IDENTITY.as_flattened()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(error < 1e-9, "{error}");
        assert!(inverse_root(&[[f64::NAN; 6]; 6]).is_none());
    }

    /// Each number moves the points equally far in the photo, and all six directions are equivalent except for damping.
    #[test]
    fn numbers_move_the_points_equally_far() {
        let (camera, points) = (camera(), points());
        let matrix = view_preconditioner(&camera, &points, 4.0);
        assert_ne!(matrix, IDENTITY);
        let moved = |numbers: [f64; 6]| -> f64 {
            let pose = matrix.map(|row| row.iter().zip(numbers).map(|(a, b)| a * b).sum::<f64>());
            let shift = camera.rotation.transpose() * (4.0 * DVec3::new(pose[3], pose[4], pose[5]));
            let posed = camera.corrected(DVec3::new(pose[0], pose[1], pose[2]), shift);
            let apart =
                |point: &Point| Some(posed.sees(point.position)?.distance_squared(camera.sees(point.position)?));
            let apart: Vec<f64> = points.iter().filter_map(apart).collect();
            (apart.iter().sum::<f64>() / apart.len() as f64).sqrt() / camera.fx
        };
        for k in 0..6 {
            let mut numbers = [0.0; 6];
            numbers[k] = 1e-3;
            assert!((0.8..1.02).contains(&(moved(numbers) / 1e-3)), "{k}: {}", moved(numbers) / 1e-3);
        }
        assert_eq!(view_preconditioner(&camera, &points[..9], 4.0), IDENTITY, "too few points");
    }
}
