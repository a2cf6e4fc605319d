//! Spherical harmonics of a Gaussian's colour, degrees 0 to 3, with the constants of `glsl/include/constants.glsl`.

use glam::DVec3;

/// Number of coefficients above degree 0, up to degree 3.
pub const COEFFICIENTS: usize = coefficients(3);

/// The basis function of degree 0.
pub const SH_C0: f64 = 0.282_094_791_773_878_14;
const SH_C1: f64 = 0.488_602_511_902_919_9;
const SH_C2_0: f64 = 1.092_548_430_592_079_2;
const SH_C2_2: f64 = 0.315_391_565_252_520_05;
const SH_C2_4: f64 = 0.546_274_215_296_039_6;
const SH_C3_0: f64 = 0.590_043_589_926_643_5;
const SH_C3_1: f64 = 2.890_611_442_640_554;
const SH_C3_2: f64 = 0.457_045_799_464_465_8;
const SH_C3_3: f64 = 0.373_176_332_590_115_46;
const SH_C3_5: f64 = 1.445_305_721_320_277;

/// Returns the number of coefficients above degree 0 up to a degree: 0, 3, 8 or 15.
pub const fn coefficients(degree: u32) -> usize {
    ((degree + 1) * (degree + 1) - 1) as usize
}

/// Returns the degree-0 coefficient of a value, 0 to 1.
pub fn sh0_of(value: f64) -> f32 {
    ((value - 0.5) / SH_C0) as f32
}

/// Returns the value of a degree-0 coefficient.
pub fn value_of(sh0: f32) -> f64 {
    0.5 + SH_C0 * f64::from(sh0)
}

/// Returns the basis functions above degree 0 in a direction, as in `glsl/include/sh.glsl`.
pub fn basis(DVec3 { x, y, z }: DVec3) -> [f64; COEFFICIENTS] {
    let (xx, yy, zz) = (x * x, y * y, z * z);
    [
        -SH_C1 * y,
        SH_C1 * z,
        -SH_C1 * x,
        SH_C2_0 * x * y,
        -SH_C2_0 * y * z,
        SH_C2_2 * (2.0 * zz - xx - yy),
        -SH_C2_0 * x * z,
        SH_C2_4 * (xx - yy),
        -SH_C3_0 * y * (3.0 * xx - yy),
        SH_C3_1 * x * y * z,
        -SH_C3_2 * y * (4.0 * zz - xx - yy),
        SH_C3_3 * z * (2.0 * zz - 3.0 * xx - 3.0 * yy),
        -SH_C3_2 * x * (4.0 * zz - xx - yy),
        SH_C3_5 * z * (xx - yy),
        -SH_C3_0 * x * (xx - 3.0 * yy),
    ]
}
