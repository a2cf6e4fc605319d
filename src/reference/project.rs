//! Projects Gaussians of the world to splats of a view, and carries gradients back.

use super::splat::{Splat, SplatGradient};
use super::{Model, Row, Rules, sh, sort, tile};
use glam::{DMat3, DVec2, DVec3};
use labelgs_scene::Camera;

/// A splat with the intermediate results of its projection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Projection {
    /// The splat.
    pub splat: Splat,
    /// (xx, xy, yy) of the dilated covariance, px^2.
    pub cov2d: [f64; 3],
    /// Relative distance of x/z and y/z to the clamp in the Jacobian.
    pub clamp_margin: f64,
    /// Distance of a colour channel to its clamp at 0.
    pub colour_margin: f64,
}

/// Rotation matrix of a unit quaternion (w, x, y, z).
pub fn rotation(q: [f64; 4]) -> DMat3 {
    let [w, x, y, z] = q;
    DMat3::from_cols(
        DVec3::new(1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)),
        DVec3::new(2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)),
        DVec3::new(2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)),
    )
}

/// Scales a quaternion to length 1; also returns its original length.
pub fn normalised(q: [f64; 4]) -> ([f64; 4], f64) {
    let length = q.iter().map(|v| v * v).sum::<f64>().sqrt();
    (q.map(|v| v / length), length)
}

/// Logistic function.
pub fn sigmoid(logit: f64) -> f64 {
    1.0 / (1.0 + (-logit).exp())
}

/// Gradient of a quaternion (before normalisation), given the gradient of its rotation matrix.
fn quat_backward(quat: [f64; 4], v_rotation: DMat3) -> [f64; 4] {
    let ([w, x, y, z], length) = normalised(quat);
    // g(r, c) = derivative with respect to row r, column c.
    let g = |row: usize, column: usize| v_rotation.col(column)[row];
    let v_unit = [
        2.0 * (x * (g(2, 1) - g(1, 2)) + y * (g(0, 2) - g(2, 0)) + z * (g(1, 0) - g(0, 1))),
        2.0 * (y * (g(0, 1) + g(1, 0)) + z * (g(0, 2) + g(2, 0)) + w * (g(2, 1) - g(1, 2)))
            - 4.0 * x * (g(1, 1) + g(2, 2)),
        2.0 * (x * (g(0, 1) + g(1, 0)) + z * (g(1, 2) + g(2, 1)) + w * (g(0, 2) - g(2, 0)))
            - 4.0 * y * (g(0, 0) + g(2, 2)),
        2.0 * (x * (g(0, 2) + g(2, 0)) + y * (g(1, 2) + g(2, 1)) + w * (g(1, 0) - g(0, 1)))
            - 4.0 * z * (g(0, 0) + g(1, 1)),
    ];
    let unit = [w, x, y, z];
    let along: f64 = unit.iter().zip(v_unit).map(|(a, b)| a * b).sum();
    [0, 1, 2, 3].map(|i| (v_unit[i] - unit[i] * along) / length)
}

/// One clamped slope of the Jacobian (x/z or y/z).
#[derive(Clone, Copy, Debug)]
struct Slope {
    value: f64,
    clamped: bool,
    margin: f64,
}

/// Computes a slope for `ratio` = x/z or y/z; limits are `jacobian_margin` half-widths beyond the image borders.
fn slope(rules: &Rules, ratio: f64, focal: f64, centre: f64, size: f64) -> Slope {
    let half = 0.5 * size / focal;
    let (low, high) =
        (-centre / focal - rules.jacobian_margin * half, (size - centre) / focal + rules.jacobian_margin * half);
    Slope {
        value: ratio.clamp(low, high),
        clamped: ratio < low || ratio > high,
        margin: (ratio - low).abs().min((ratio - high).abs()) / half,
    }
}

/// All intermediate quantities between a row and its splat.
struct Chain {
    /// Camera-space position.
    camera: DVec3,
    slopes: [Slope; 2],
    /// Rows of J W, 2 x 3.
    screen_from_world: [DVec3; 2],
    /// R_q S, 3 x 3.
    spread: DMat3,
    /// Rows of M = J W R_q S, 2 x 3.
    spread2d: [DVec3; 2],
    cov2d: [f64; 3],
    conic: [f64; 3],
    /// Inverse of the covariance before dilation.
    sharp: [f64; 3],
    /// Factor of the opacity: the root of the determinant before dilation by that after it; 1 if not antialiased.
    coverage: f64,
}

fn chain(rules: &Rules, camera: &Camera, row: &Row) -> Chain {
    let p = camera.rotation * DVec3::from(row.mean) + camera.translation;
    let (width, height) = (f64::from(camera.width), f64::from(camera.height));
    let slopes =
        [slope(rules, p.x / p.z, camera.fx, camera.cx, width), slope(rules, p.y / p.z, camera.fy, camera.cy, height)];
    let jacobian = [
        DVec3::new(camera.fx / p.z, 0.0, -camera.fx * slopes[0].value / p.z),
        DVec3::new(0.0, camera.fy / p.z, -camera.fy * slopes[1].value / p.z),
    ];
    let screen_from_world = jacobian.map(|j| camera.rotation.transpose() * j);
    let spread = rotation(normalised(row.quat).0) * DMat3::from_diagonal(DVec3::from(row.scale.map(f64::exp)));
    let m = screen_from_world.map(|b| spread.transpose() * b);
    let (xx, xy, yy) = (m[0].length_squared(), m[0].dot(m[1]), m[1].length_squared());
    let s = rules.dilation;
    // Cauchy-Binet: det(M M^T) = |m0 x m1|^2 avoids cancellation.
    let before = m[0].cross(m[1]).length_squared();
    let det = before + s * (xx + yy) + s * s;
    let cov2d = [xx + s, xy, yy + s];
    let conic = [cov2d[2] / det, -xy / det, cov2d[0] / det];
    let sharp = [yy / before, -xy / before, xx / before];
    let coverage = if rules.antialiased { (before / det).sqrt() } else { 1.0 };
    Chain { camera: p, slopes, screen_from_world, spread, spread2d: m, cov2d, conic, sharp, coverage }
}

/// Relative distance of a Gaussian to the near plane; negative behind it.
pub fn near_margin(rules: &Rules, camera: &Camera, row: &Row) -> f64 {
    let z = (camera.rotation * DVec3::from(row.mean) + camera.translation).z;
    (z - rules.near) / rules.near
}

/// The splat of row `gaussian`; `None` at or behind the near plane.
pub fn project_forward(rules: &Rules, camera: &Camera, model: &Model, gaussian: usize) -> Option<Projection> {
    let row = &model.rows[gaussian];
    if near_margin(rules, camera, row) <= 0.0 {
        return None;
    }
    let chain = chain(rules, camera, row);
    let p = chain.camera;
    let colour = sh::sh_forward(rules, model.sh_degree, &row.sh, DVec3::from(row.mean), camera.centre());
    Some(Projection {
        splat: Splat {
            gaussian,
            depth: p.z,
            mean2d: [camera.fx * p.x / p.z + camera.cx, camera.fy * p.y / p.z + camera.cy],
            conic: chain.conic,
            opacity: sigmoid(row.opacity) * chain.coverage,
            colour: colour.rgb,
        },
        cov2d: chain.cov2d,
        clamp_margin: chain.slopes[0].margin.min(chain.slopes[1].margin),
        colour_margin: colour.margin,
    })
}

/// True if the Gaussian counts somewhere between the outermost pixel centres. A kernel may keep more Gaussians, never
/// fewer.
pub fn cull(rules: &Rules, camera: &Camera, model: &Model, gaussian: usize) -> bool {
    let size = (camera.width as usize, camera.height as usize);
    project_forward(rules, camera, model, gaussian)
        .is_some_and(|projection| tile::cull(rules, &projection.splat, size).touches)
}

/// Splats of every Gaussian that counts somewhere in the image, nearest first, ties by Gaussian index.
pub fn project_all(rules: &Rules, camera: &Camera, model: &Model) -> Vec<Projection> {
    let found: Vec<Projection> = (0..model.rows.len())
        .filter(|&gaussian| cull(rules, camera, model, gaussian))
        .filter_map(|gaussian| project_forward(rules, camera, model, gaussian))
        .collect();
    let order = sort::depth_sort(&found.iter().map(|p| p.splat.depth).collect::<Vec<_>>());
    order.iter().map(|&i| found[i]).collect()
}

/// Gradient of a row, given the gradient of its splat.
pub fn project_backward(rules: &Rules, camera: &Camera, model: &Model, gaussian: usize, v: &SplatGradient) -> Row {
    let row = &model.rows[gaussian];
    let chain = chain(rules, camera, row);
    let p = chain.camera;
    let mean = DVec3::from(row.mean);
    let (v_sh, v_mean_colour) = sh::sh_backward(rules, model.sh_degree, &row.sh, (mean, camera.centre()), v.colour);
    let o = sigmoid(row.opacity);
    let v_coverage = if rules.antialiased { v.opacity * o } else { 0.0 };
    let (v_screen, v_spread) = covariance_backward(&chain, v.conic, v_coverage);

    // Jacobian rows in camera axes: (f/z, 0, -f s/z) with s the clamped slope.
    let v_jacobian = v_screen.map(|b| camera.rotation * b);
    let v_mean2d = DVec2::from(v.mean2d);
    let mut v_p = DVec3::new(
        v_mean2d.x * camera.fx / p.z,
        v_mean2d.y * camera.fy / p.z,
        -(v_mean2d.x * camera.fx * p.x + v_mean2d.y * camera.fy * p.y) / (p.z * p.z),
    );
    for (axis, focal) in [camera.fx, camera.fy].into_iter().enumerate() {
        let (slope, v_j) = (chain.slopes[axis], v_jacobian[axis]);
        v_p.z += -focal / (p.z * p.z) * v_j[axis] + focal * slope.value / (p.z * p.z) * v_j.z;
        if !slope.clamped {
            let v_slope = -focal / p.z * v_j.z;
            v_p[axis] += v_slope / p.z;
            v_p.z -= v_slope * slope.value / p.z;
        }
    }

    let scales = row.scale.map(f64::exp);
    let turn = rotation(normalised(row.quat).0);
    let v_scale = [0, 1, 2].map(|i| scales[i] * turn.col(i).dot(v_spread.col(i)));
    let v_turn = v_spread * DMat3::from_diagonal(DVec3::from(scales));
    Row {
        mean: (camera.rotation.transpose() * v_p + v_mean_colour).into(),
        quat: quat_backward(row.quat, v_turn),
        scale: v_scale,
        opacity: v.opacity * chain.coverage * o * (1.0 - o),
        sh: v_sh,
    }
}

/// Gradients of J W (two rows) and of R_q S, given those of the conic and of the coverage.
fn covariance_backward(chain: &Chain, v_conic: [f64; 3], v_coverage: f64) -> ([DVec3; 2], DMat3) {
    // conic = cov^-1, so d cov = -conic (d conic) conic; each off-diagonal entry has half of B's derivative.
    let [a, b, c] = chain.conic;
    let [ga, gb, gc] = [v_conic[0], 0.5 * v_conic[1], v_conic[2]];
    let left = [[a * ga + b * gb, a * gb + b * gc], [b * ga + c * gb, b * gb + c * gc]];
    // d ln coverage = (before^-1 - cov^-1) (d cov) / 2.
    let half = 0.5 * v_coverage * chain.coverage;
    let of_coverage = |at: usize| if half == 0.0 { 0.0 } else { half * (chain.sharp[at] - chain.conic[at]) };
    let v_xx = of_coverage(0) - (left[0][0] * a + left[0][1] * b);
    let v_xy = of_coverage(1) - (left[0][0] * b + left[0][1] * c);
    let v_yy = of_coverage(2) - (left[1][0] * b + left[1][1] * c);
    // cov = M M^T + s I, so d M = 2 (d cov) M.
    let m = chain.spread2d;
    let v_m = [2.0 * (v_xx * m[0] + v_xy * m[1]), 2.0 * (v_xy * m[0] + v_yy * m[1])];
    // M = B D with B = J W and D = R_q S: d B = (d M) D^T, d D = B^T (d M).
    let v_b = v_m.map(|row| chain.spread * row);
    let outer =
        |column: usize| chain.screen_from_world[0] * v_m[0][column] + chain.screen_from_world[1] * v_m[1][column];
    (v_b, DMat3::from_cols(outer(0), outer(1), outer(2)))
}
