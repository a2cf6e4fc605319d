//! Pose correction of a photo by two trained rows, and the gradient of these rows.

use super::{Model, Row, Rules, sh};
use glam::DVec3;
use labelgs_scene::Camera;

/// The rows of a photo: two rows of three trained numbers, whose fourth components are 1 once the pose is settled, and
/// the unit of translation; then the six rows of the preconditioner, in two rows each.
pub type PoseRows = [[f64; 4]; 14];

fn three([x, y, z, _]: [f64; 4]) -> DVec3 {
    DVec3::new(x, y, z)
}

/// Rotation (Rodrigues vector in camera space) and translation (camera space, in its unit): the preconditioner times
/// the trained numbers.
fn correction(rows: &PoseRows) -> (DVec3, DVec3) {
    let of = |k: usize| three(rows[2 * k + 2]).dot(three(rows[0])) + three(rows[2 * k + 3]).dot(three(rows[1]));
    (DVec3::new(of(0), of(1), of(2)), DVec3::new(of(3), of(4), of(5)))
}

/// The corrected camera.
pub fn corrected(camera: &Camera, rows: &PoseRows) -> Camera {
    let (turn, shift) = correction(rows);
    camera.corrected(turn, camera.rotation.transpose() * (rows[1][3] * shift))
}

/// Gradient of the trained numbers. `camera` is the uncorrected camera; `v_rows` are the Gaussians' gradients with the
/// corrected camera; `prior` pulls rotation and translation to 0.
pub fn backward(
    rules: &Rules,
    camera: &Camera,
    rows: &PoseRows,
    (model, v_rows): (&Model, &[Row]),
    prior: f64,
) -> [[f64; 3]; 2] {
    let (turn, shift) = correction(rows);
    let posed = corrected(camera, rows);
    let (mut force, mut torque) = (DVec3::ZERO, DVec3::ZERO);
    for (row, v) in model.rows.iter().zip(v_rows) {
        let (mean, centre) = (DVec3::from(row.mean), posed.centre());
        let v_colour = v.sh[0].map(|of_constant| of_constant / rules.sh_c0);
        let (_, of_direction) = sh::sh_backward(rules, model.sh_degree, &row.sh, (mean, centre), v_colour);
        // Moving the camera is moving all Gaussians the other way.
        force += DVec3::from(v.mean);
        // A rotation around its centre changes no view direction in the world.
        torque += (mean - centre).cross(DVec3::from(v.mean) - of_direction);
        // dq = (0, d / 2) q for a small rotation d in world space.
        let ([w, x, y, z], [vw, vx, vy, vz]) = (row.quat, v.quat);
        let (q, v_q) = (DVec3::new(x, y, z), DVec3::new(vx, vy, vz));
        torque += 0.5 * (w * v_q - vw * q + q.cross(v_q));
    }
    // Angular velocity of a Rodrigues vector w = turn / 2: 2 (w' + w x w') / (1 + w w).
    let (half, torque) = (0.5 * turn, posed.rotation * torque);
    let v_turn = (torque + torque.cross(half)) / (1.0 + half.length_squared()) + prior * turn;
    let v_move = -rows[1][3] * (camera.rotation * force) + prior * shift;
    let open = 1.0 - rows[0][3];
    let v = [(open * v_turn).to_array(), (open * v_move).to_array()].concat();
    let through = |column: usize| (0..6).map(|k| v[k] * three(rows[2 * k + 2 + column])).sum::<DVec3>().to_array();
    [through(0), through(1)]
}
