//! Converts SPZ values to bytes and back.

use crate::values::{byte, index_of_largest, unit};

/// Coefficients 1 to 3 keep 5 bits, higher ones 4, like other writers; fewer bits compress better.
const SH_STEPS: [i32; 2] = [8, 16];
/// Number of coefficients of degree 1.
const DEGREE_1_COEFFICIENTS: usize = 3;
/// Largest absolute value among the three smaller components of a unit quaternion.
const SMALL_MAX: f32 = std::f32::consts::FRAC_1_SQRT_2;

pub(super) fn colour(value: f32) -> u8 {
    byte(value * 0.15 * 255.0 + 127.5)
}

pub(super) fn sh0(colour: u8) -> f32 {
    (f32::from(colour) / 255.0 - 0.5) / 0.15
}

pub(super) fn scale_byte(scale: f32) -> u8 {
    byte((scale + 10.0) * 16.0)
}

pub(super) fn scale(byte: u8) -> f32 {
    f32::from(byte) / 16.0 - 10.0
}

/// Encodes a coefficient above degree 0; `index` counts from 0 at degree 1.
pub(super) fn harmonic(index: usize, value: f32) -> u8 {
    let step = SH_STEPS[usize::from(index >= DEGREE_1_COEFFICIENTS)];
    let fine = (value * 128.0).round().clamp(-256.0, 256.0) as i32 + 128;
    ((fine + step / 2).div_euclid(step) * step).clamp(0, 255) as u8
}

pub(super) fn rest(byte: u8) -> f32 {
    (f32::from(byte) - 128.0) / 128.0
}

/// Encodes a 24-bit position.
pub(super) fn position(value: f32, bits: u32) -> [u8; 3] {
    let steps = (f64::from(value) * f64::from(1_u32 << bits)).round() as i32;
    let [a, b, c, _] = steps.to_le_bytes();
    [a, b, c]
}

/// Decodes a 24-bit position.
pub(super) fn decode_position(bytes: &[u8], bits: u32) -> f64 {
    let steps = i32::from_le_bytes([0, bytes[0], bytes[1], bytes[2]]) >> 8;
    f64::from(steps) / f64::from(1_u32 << bits)
}

/// Encodes a rotation (w, x, y, z) in four bytes: the index of the largest component, and 10 bits for each of the
/// others.
pub(super) fn rotation(quat: [f32; 4]) -> [u8; 4] {
    let [w, x, y, z] = unit(quat);
    let unit = [x, y, z, w];
    let largest = index_of_largest(unit);
    let mut packed = largest as u32;
    for at in (0..4).filter(|&at| at != largest) {
        let is_negative = (unit[at] < 0.0) != (unit[largest] < 0.0);
        let steps = (511.0 * (unit[at].abs() / SMALL_MAX) + 0.5) as u32;
        packed = packed << 10 | u32::from(is_negative) << 9 | steps.min(511);
    }
    packed.to_le_bytes()
}

/// Decodes a rotation (w, x, y, z) from four bytes.
pub(super) fn quat(bytes: [u8; 4]) -> [f64; 4] {
    let mut packed = u32::from_le_bytes(bytes);
    let largest = (packed >> 30) as usize;
    let mut xyzw = [0.0; 4];
    let mut squares = 0.0;
    for at in (0..4).rev().filter(|&at| at != largest) {
        let size = f64::from(packed & 511) / 511.0 * f64::from(SMALL_MAX);
        xyzw[at] = if packed >> 9 & 1 == 1 { -size } else { size };
        squares += size * size;
        packed >>= 10;
    }
    xyzw[largest] = (1.0 - squares).max(0.0).sqrt();
    let [x, y, z, w] = xyzw;
    [w, x, y, z]
}

/// Decodes a rotation (w, x, y, z) from the three bytes of versions 1 and 2.
pub(super) fn old_quat(bytes: &[u8]) -> [f64; 4] {
    let [x, y, z] = [bytes[0], bytes[1], bytes[2]].map(|byte| f64::from(byte) / 127.5 - 1.0);
    [(1.0 - x * x - y * y - z * z).max(0.0).sqrt(), x, y, z]
}
