//! Real spherical harmonics to degree 3 as polynomials of the unit direction.

use super::Rules;
use glam::DVec3;

/// Number of coefficients up to a degree: (degree + 1)^2.
pub fn coefficients(degree: u32) -> usize {
    ((degree + 1) * (degree + 1)) as usize
}

/// Values of the 16 basis functions at a direction (x, y, z).
pub fn basis(rules: &Rules, dir: DVec3) -> [f64; 16] {
    let DVec3 { x, y, z } = dir;
    let (c2, c3) = (rules.sh_c2, rules.sh_c3);
    [
        rules.sh_c0,
        -rules.sh_c1 * y,
        rules.sh_c1 * z,
        -rules.sh_c1 * x,
        c2[0] * x * y,
        c2[1] * y * z,
        c2[2] * (2.0 * z * z - x * x - y * y),
        c2[3] * x * z,
        c2[4] * (x * x - y * y),
        c3[0] * y * (3.0 * x * x - y * y),
        c3[1] * x * y * z,
        c3[2] * y * (4.0 * z * z - x * x - y * y),
        c3[3] * z * (2.0 * z * z - 3.0 * x * x - 3.0 * y * y),
        c3[4] * x * (4.0 * z * z - x * x - y * y),
        c3[5] * z * (x * x - y * y),
        c3[6] * x * (x * x - 3.0 * y * y),
    ]
}

/// Gradients of the 16 polynomials at (x, y, z).
pub fn basis_gradient(rules: &Rules, dir: DVec3) -> [DVec3; 16] {
    let DVec3 { x, y, z } = dir;
    let (c1, c2, c3) = (rules.sh_c1, rules.sh_c2, rules.sh_c3);
    let v = DVec3::new;
    [
        DVec3::ZERO,
        c1 * v(0.0, -1.0, 0.0),
        c1 * v(0.0, 0.0, 1.0),
        c1 * v(-1.0, 0.0, 0.0),
        c2[0] * v(y, x, 0.0),
        c2[1] * v(0.0, z, y),
        c2[2] * v(-2.0 * x, -2.0 * y, 4.0 * z),
        c2[3] * v(z, 0.0, x),
        c2[4] * v(2.0 * x, -2.0 * y, 0.0),
        c3[0] * v(6.0 * x * y, 3.0 * x * x - 3.0 * y * y, 0.0),
        c3[1] * v(y * z, x * z, x * y),
        c3[2] * v(-2.0 * x * y, 4.0 * z * z - x * x - 3.0 * y * y, 8.0 * y * z),
        c3[3] * v(-6.0 * x * z, -6.0 * y * z, 6.0 * z * z - 3.0 * x * x - 3.0 * y * y),
        c3[4] * v(4.0 * z * z - 3.0 * x * x - y * y, -2.0 * x * y, 8.0 * x * z),
        c3[5] * v(2.0 * x * z, -2.0 * y * z, x * x - y * y),
        c3[6] * v(3.0 * x * x - 3.0 * y * y, -6.0 * x * y, 0.0),
    ]
}

/// A colour with its intermediate results.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Colour {
    /// max(0, SH + bias).
    pub rgb: [f64; 3],
    /// Colour before the clamp.
    pub raw: [f64; 3],
    /// Distance of the nearest channel to the clamp.
    pub margin: f64,
}

/// Colour seen from `centre` of a Gaussian at `mean`.
pub fn sh_forward(rules: &Rules, degree: u32, sh: &[[f64; 3]; 16], mean: DVec3, centre: DVec3) -> Colour {
    let values = basis(rules, (mean - centre).normalize());
    let raw = [0, 1, 2].map(|channel| {
        let terms = (0..coefficients(degree)).map(|k| values[k] * sh[k][channel]);
        terms.sum::<f64>() + rules.colour_bias
    });
    let margin = raw.iter().fold(f64::INFINITY, |least, value| least.min(value.abs()));
    Colour { rgb: raw.map(|value| value.max(0.0)), raw, margin }
}

/// Gradients of the coefficients and of the mean, given the gradient of the colour.
pub fn sh_backward(
    rules: &Rules,
    degree: u32,
    sh: &[[f64; 3]; 16],
    (mean, centre): (DVec3, DVec3),
    v_colour: [f64; 3],
) -> ([[f64; 3]; 16], DVec3) {
    let raw = sh_forward(rules, degree, sh, mean, centre).raw;
    let v_raw = [0, 1, 2].map(|channel| if raw[channel] > 0.0 { v_colour[channel] } else { 0.0 });
    let (offset, dir) = (mean - centre, (mean - centre).normalize());
    let (values, slopes) = (basis(rules, dir), basis_gradient(rules, dir));
    let mut v_sh = [[0.0; 3]; 16];
    let mut v_dir = DVec3::ZERO;
    for k in 0..coefficients(degree) {
        for channel in 0..3 {
            v_sh[k][channel] = values[k] * v_raw[channel];
            v_dir += slopes[k] * sh[k][channel] * v_raw[channel];
        }
    }
    // d(offset / |offset|) = (I - dir dir^T) d offset / |offset|
    (v_sh, (v_dir - dir * dir.dot(v_dir)) / offset.length())
}
