//! Moves, turns and scales a model, including its view-dependent colours.

use super::axis_signs::Signs;
use glam::{DMat3, DMat4, DQuat, DVec3};
use labelgs_scene::harmonics::{COEFFICIENTS, basis};
use labelgs_scene::origin::far_origin;
use labelgs_scene::{Error, Gaussians, Result, Setting};
use std::f64::consts::TAU;

/// Index of the first coefficient of each degree above 0, and of the end.
const DEGREE_STARTS: [usize; 4] = [0, 3, 8, COEFFICIENTS];
/// Nodes and weights of Gauss-Legendre quadrature. Four nodes are exact up to degree 7; a product of two functions of
/// degree 3 has degree 6.
const QUADRATURE_NODES: [(f64, f64); 4] = [
    (-0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
    (-0.339_981_043_584_856_3, 0.652_145_154_862_546_1),
    (0.339_981_043_584_856_3, 0.652_145_154_862_546_1),
    (0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
];
/// Largest relative difference between axis scales, and largest cosine between axes, of a similarity transform.
const SIMILARITY_ERROR_MAX: f64 = 1e-4;
/// Azimuth samples: exact up to degree 7.
const AZIMUTH_SAMPLES: u32 = 8;

/// A similarity transform: world' = scale * turn * (world - origin).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transform {
    /// The position that becomes (0, 0, 0), world units.
    pub origin: DVec3,
    /// The rotation.
    pub turn: DQuat,
    /// The scale factor, above 0.
    pub scale: f64,
}

impl Default for Transform {
    fn default() -> Self {
        Self { origin: DVec3::ZERO, turn: DQuat::IDENTITY, scale: 1.0 }
    }
}

impl Transform {
    /// Returns the shortest rotation that turns an up direction of the model to -y, the up direction of 3DGS files.
    pub fn upright(up: DVec3) -> Result<DQuat> {
        let up = up.try_normalize();
        let up = up.ok_or_else(|| {
            Error::usage(Setting("up"), "has no direction; expected a non-zero vector, such as 0,0,1")
        })?;
        Ok(DQuat::from_rotation_arc(up, DVec3::NEG_Y))
    }

    /// Converts a matrix in a file's axes, which are a half turn away from ours. Returns `None` if it is not a
    /// similarity transform.
    pub(super) fn from_matrix(matrix: DMat4, axes_of_file: Signs) -> Option<Self> {
        let linear = DMat3::from_mat4(matrix);
        let axes = [linear.x_axis, linear.y_axis, linear.z_axis];
        let scale = linear.determinant().cbrt();
        let is_even = axes.iter().all(|axis| (axis.length() / scale - 1.0).abs() < SIMILARITY_ERROR_MAX);
        let is_square = [(0, 1), (0, 2), (1, 2)]
            .iter()
            .all(|&(a, b)| axes[a].dot(axes[b]).abs() < SIMILARITY_ERROR_MAX * scale * scale);
        let place = matrix.w_axis.truncate();
        if !(scale > 0.0 && scale.is_finite() && place.is_finite() && is_even && is_square) {
            return None;
        }
        if matrix == DMat4::IDENTITY {
            return Some(Self::default());
        }
        let DQuat { x, y, z, w } =
            DQuat::from_mat3(&DMat3::from_cols(axes[0] / scale, axes[1] / scale, axes[2] / scale));
        let sign = axes_of_file.0.map(f64::from);
        let turn = DQuat::from_xyzw(sign[1] * sign[2] * x, sign[0] * sign[2] * y, sign[0] * sign[1] * z, w).normalize();
        let moved = DVec3::from_array(sign) * place;
        Some(Self { origin: turn.inverse() * -moved / scale, turn, scale })
    }

    /// Transforms a point, world units.
    pub fn place(&self, place: DVec3) -> DVec3 {
        self.scale * (self.turn * (place - self.origin))
    }

    /// Returns the transformed model.
    pub fn apply(&self, model: &Gaussians) -> Result<Gaussians> {
        if !(self.scale > 0.0 && self.scale.is_finite() && self.origin.is_finite() && self.turn.is_normalized()) {
            return Err(Error::usage("Transform", format!("{self:?} is not a finite transform with a scale above 0")));
        }
        let places: Vec<DVec3> = (0..model.len()).map(|row| self.place(model.world(row))).collect();
        let mut to = model.clone();
        to.origin = far_origin(&places);
        to.means = places.iter().map(|&place| (place - to.origin).as_vec3().to_array()).collect();
        let larger = self.scale.ln();
        to.scales.iter_mut().flatten().for_each(|scale| *scale = (f64::from(*scale) + larger) as f32);
        if self.turn == DQuat::IDENTITY {
            return Ok(to);
        }
        for quat in &mut to.quats {
            let [w, x, y, z] = quat.map(f64::from);
            // Preserve the length of the quaternion.
            let turned = self.turn * DQuat::from_xyzw(x, y, z, w);
            *quat = [turned.w, turned.x, turned.y, turned.z].map(|value| value as f32);
        }
        let along = harmonics(self.turn);
        let rest = model.rest_per_gaussian();
        let degrees = &DEGREE_STARTS[..=model.sh_degree as usize];
        for (to, from) in to.sh_rest.chunks_exact_mut(rest.max(1)).zip(model.sh_rest.chunks_exact(rest.max(1))) {
            for ends in degrees.windows(2) {
                for at in ends[0]..ends[1] {
                    let part = |channel: usize| {
                        (ends[0]..ends[1]).map(|k| along[at][k] * f64::from(from[k][channel])).sum::<f64>() as f32
                    };
                    to[at] = [part(0), part(1), part(2)];
                }
            }
        }
        Ok(to)
    }
}

/// Returns the matrix that rotates SH coefficients: the integral over all directions of each basis function times each
/// rotated one. It is 0 between different degrees.
fn harmonics(turn: DQuat) -> [[f64; COEFFICIENTS]; COEFFICIENTS] {
    let mut matrix = [[0.0; COEFFICIENTS]; COEFFICIENTS];
    let back = turn.inverse();
    for (z, weight) in QUADRATURE_NODES {
        for at in 0..AZIMUTH_SAMPLES {
            let (sin, cos) = (TAU * f64::from(at) / f64::from(AZIMUTH_SAMPLES)).sin_cos();
            let radius = (1.0 - z * z).sqrt();
            let direction = DVec3::new(radius * cos, radius * sin, z);
            let (here, before) = (basis(direction), basis(back * direction));
            let share = weight * TAU / f64::from(AZIMUTH_SAMPLES);
            for (row, &value) in matrix.iter_mut().zip(&here) {
                row.iter_mut().zip(&before).for_each(|(sum, other)| *sum += share * value * other);
            }
        }
    }
    matrix
}
