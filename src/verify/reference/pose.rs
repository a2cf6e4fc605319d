//! Pose of a photo: the camera that two rows of the photo correct, and the gradient of the rows.

use super::{Model, Row, Rules, sh};
use crate::scene::Camera;
use glam::DVec3;

/// The rows: a turn, and a move in camera space in units of its fourth number.
pub type PoseRows = [[f64; 4]; 2];

/// The turn (Rodrigues vector in camera space) and the move of the centre (world units) of two rows.
fn correction(camera: &Camera, [turn, [x, y, z, unit]]: PoseRows) -> (DVec3, DVec3) {
    let turn = DVec3::new(turn[0], turn[1], turn[2]);
    (turn, camera.rotation.transpose() * (unit * DVec3::new(x, y, z)))
}

/// The corrected camera.
pub fn corrected(camera: &Camera, rows: PoseRows) -> Camera {
    let (turn, shift) = correction(camera, rows);
    camera.corrected(turn, shift)
}

/// Gradient of the rows. `camera` is the camera before the correction; `v_rows` are the gradients of the Gaussians with the
/// corrected one; `prior` pulls turn and move to 0.
pub fn backward(
    rules: &Rules,
    camera: &Camera,
    rows: PoseRows,
    (model, v_rows): (&Model, &[Row]),
    prior: f64,
) -> [[f64; 3]; 2] {
    let (turn, _) = correction(camera, rows);
    let posed = corrected(camera, rows);
    let (mut force, mut torque) = (DVec3::ZERO, DVec3::ZERO);
    for (row, v) in model.rows.iter().zip(v_rows) {
        let (mean, centre) = (DVec3::from(row.mean), posed.centre());
        let v_colour = v.sh[0].map(|of_constant| of_constant / rules.sh_c0);
        let (_, of_direction) = sh::sh_backward(rules, model.sh_degree, &row.sh, (mean, centre), v_colour);
        // A move of the camera is a move of all Gaussians the other way.
        force += DVec3::from(v.mean);
        // A turn around its centre changes no direction of view in the world.
        torque += (mean - centre).cross(DVec3::from(v.mean) - of_direction);
        // dq = (0, d / 2) q for a small turn d in world space.
        let ([w, x, y, z], [vw, vx, vy, vz]) = (row.quat, v.quat);
        let (q, v_q) = (DVec3::new(x, y, z), DVec3::new(vx, vy, vz));
        torque += 0.5 * (w * v_q - vw * q + q.cross(v_q));
    }
    // Angular velocity of a Rodrigues vector w = turn / 2: 2 (w' + w x w') / (1 + w w).
    let (half, torque) = (0.5 * turn, posed.rotation * torque);
    let v_turn = (torque + torque.cross(half)) / (1.0 + half.length_squared());
    let [of_turn, of_move] = rows.map(|[x, y, z, _]| prior * DVec3::new(x, y, z));
    let v_move = -rows[1][3] * (camera.rotation * force);
    [(v_turn + of_turn).to_array(), (v_move + of_move).to_array()]
}
