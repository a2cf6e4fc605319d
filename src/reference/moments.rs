//! Packs both Adam moments of a parameter into one word: their ratio, and the logarithm of the second moment's root.

use super::Rules;
use super::random::hash;

/// First random draw of an element that is used for moments.
const FIRST_DRAW: u32 = 64;
/// Parts per element; each is a parameter.
const ELEMENT_PARTS: u32 = 4;

/// Returns the random draw for a parameter: part `part` of an element of a plane.
pub fn draw(seed: u32, element: u32, plane: u32, part: u32) -> u32 {
    hash(seed, element, FIRST_DRAW + ELEMENT_PARTS * plane + part)
}

/// Rounds stochastically to an integer: up with a probability equal to the fractional part. `draw` has 16 bits.
pub fn round_at_random(x: f64, draw: u32) -> f64 {
    let share = (f64::from(draw) + 0.5) / 65_536.0;
    x.floor() + if x - x.floor() > share { 1.0 } else { 0.0 }
}

/// Returns the root of a word's second moment.
fn root(rules: &Rules, word: u32) -> f64 {
    match word & 0xffff {
        0 => 0.0,
        code => (f64::from(code) / rules.moment_log - rules.moment_floor).exp2(),
    }
}

/// Packs a first and a second moment into a word.
pub fn pack(rules: &Rules, (m, v): (f64, f64), draw: u32) -> u32 {
    if v < f64::from(f32::MIN_POSITIVE) {
        return 0;
    }
    let octaves = v.log2() / 2.0 + rules.moment_floor;
    let code = round_at_random(rules.moment_log * octaves, draw & 0xffff).clamp(1.0, 65_535.0) as u32;
    let ratio = round_at_random(rules.moment_ratio * m / root(rules, code), draw >> 16).clamp(-32_767.0, 32_767.0);
    u32::from(ratio as i16 as u16) << 16 | code
}

/// Unpacks a word into first and second moment.
pub fn unpack(rules: &Rules, word: u32) -> (f64, f64) {
    let root = root(rules, word);
    (f64::from((word >> 16) as u16 as i16) / rules.moment_ratio * root, root * root)
}
