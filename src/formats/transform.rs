//! Moves, turns and scales a model. Colours that depend on the direction are turned along.

use super::turn::Signs;
use glam::{DMat3, DMat4, DQuat, DVec3};
use labelgs_scene::harmonics::{COEFFICIENTS, basis};
use labelgs_scene::origin::far_origin;
use labelgs_scene::{Error, Gaussians, Result, Setting};
use std::f64::consts::TAU;

/// First coefficient of each degree above 0, and one past the last.
const DEGREES: [usize; 4] = [0, 3, 8, COEFFICIENTS];
/// Nodes and weights of Gauss and Legendre. Four are exact up to degree 7, two functions of degree 3 have 6.
const NODES: [(f64, f64); 4] = [
    (-0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
    (-0.339_981_043_584_856_3, 0.652_145_154_862_546_1),
    (0.339_981_043_584_856_3, 0.652_145_154_862_546_1),
    (0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
];
/// Largest relative difference between the scales of the axes, and cosine between axes, of a turn with one scale.
const OFF_MAX: f64 = 1e-4;
/// Directions around the axis: exact up to degree 7.
const AROUND: u32 = 8;

/// A change of place: world' = scale * turn * (world - origin).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transform {
    /// The place that becomes (0, 0, 0), world units.
    pub origin: DVec3,
    /// The turn.
    pub turn: DQuat,
    /// The factor of all lengths, more than 0.
    pub scale: f64,
}

impl Default for Transform {
    fn default() -> Self {
        Self { origin: DVec3::ZERO, turn: DQuat::IDENTITY, scale: 1.0 }
    }
}

impl Transform {
    /// Returns the shortest turn that makes a direction of the model the upward one of 3DGS files, -y.
    pub fn upright(up: DVec3) -> Result<DQuat> {
        let up = up.try_normalize();
        let up = up
            .ok_or_else(|| Error::usage(Setting("up"), "is no direction; expected one with a length, such as 0,0,1"))?;
        Ok(DQuat::from_rotation_arc(up, DVec3::NEG_Y))
    }

    /// The change of place in our axes of a matrix in those of a file, which are a half turn away; `None` for one that is
    /// more than a turn, one scale and a move.
    pub(super) fn of_matrix(matrix: DMat4, axes_of_file: Signs) -> Option<Self> {
        let linear = DMat3::from_mat4(matrix);
        let axes = [linear.x_axis, linear.y_axis, linear.z_axis];
        let scale = linear.determinant().cbrt();
        let is_even = axes.iter().all(|axis| (axis.length() / scale - 1.0).abs() < OFF_MAX);
        let is_square =
            [(0, 1), (0, 2), (1, 2)].iter().all(|&(a, b)| axes[a].dot(axes[b]).abs() < OFF_MAX * scale * scale);
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

    /// Returns where a place goes, world units.
    pub fn place(&self, place: DVec3) -> DVec3 {
        self.scale * (self.turn * (place - self.origin))
    }

    /// Returns the transformed model.
    pub fn apply(&self, model: &Gaussians) -> Result<Gaussians> {
        if !(self.scale > 0.0 && self.scale.is_finite() && self.origin.is_finite() && self.turn.is_normalized()) {
            return Err(Error::usage("Transform", format!("{self:?} is no change of place with a scale above 0")));
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
            // The length of a rotation is kept, whatever it is.
            let turned = self.turn * DQuat::from_xyzw(x, y, z, w);
            *quat = [turned.w, turned.x, turned.y, turned.z].map(|value| value as f32);
        }
        let along = harmonics(self.turn);
        let rest = model.rest_per_gaussian();
        let degrees = &DEGREES[..=model.sh_degree as usize];
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

/// The matrix that turns coefficients along: the integral, over all directions, of each basis function times each one
/// turned. It is 0 between degrees.
fn harmonics(turn: DQuat) -> [[f64; COEFFICIENTS]; COEFFICIENTS] {
    let mut matrix = [[0.0; COEFFICIENTS]; COEFFICIENTS];
    let back = turn.inverse();
    for (z, weight) in NODES {
        for at in 0..AROUND {
            let (sin, cos) = (TAU * f64::from(at) / f64::from(AROUND)).sin_cos();
            let radius = (1.0 - z * z).sqrt();
            let direction = DVec3::new(radius * cos, radius * sin, z);
            let (here, before) = (basis(direction), basis(back * direction));
            let share = weight * TAU / f64::from(AROUND);
            for (row, &value) in matrix.iter_mut().zip(&here) {
                row.iter_mut().zip(&before).for_each(|(sum, other)| *sum += share * value * other);
            }
        }
    }
    matrix
}
