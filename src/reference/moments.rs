//! Both moments of Adam of a parameter in one word: their ratio, and the logarithm of the root of the second one.

use super::Rules;
use super::random::hash;

/// First of the numbers that moments draw of those of an element.
const FIRST_DRAW: u32 = 64;
/// Parts of an element, each a parameter.
const ELEMENT_PARTS: u32 = 4;

/// What is drawn for a parameter: part `part` of an element of a plane.
pub fn draw(seed: u32, element: u32, plane: u32, part: u32) -> u32 {
    hash(seed, element, FIRST_DRAW + ELEMENT_PARTS * plane + part)
}

/// Rounds to a whole number below or above, to the latter with a probability of what is above the former. `draw` has 16 bits.
pub fn round_at_random(x: f64, draw: u32) -> f64 {
    let share = (f64::from(draw) + 0.5) / 65_536.0;
    x.floor() + if x - x.floor() > share { 1.0 } else { 0.0 }
}

/// The root of the second moment of a word.
fn root(rules: &Rules, word: u32) -> f64 {
    match word & 0xffff {
        0 => 0.0,
        code => (f64::from(code) / rules.moment_log - rules.moment_floor).exp2(),
    }
}

/// Returns the word of a first and a second moment.
pub fn pack(rules: &Rules, (m, v): (f64, f64), draw: u32) -> u32 {
    if v < f64::from(f32::MIN_POSITIVE) {
        return 0;
    }
    let octaves = v.log2() / 2.0 + rules.moment_floor;
    let code = round_at_random(rules.moment_log * octaves, draw & 0xffff).clamp(1.0, 65_535.0) as u32;
    let ratio = round_at_random(rules.moment_ratio * m / root(rules, code), draw >> 16).clamp(-32_767.0, 32_767.0);
    u32::from(ratio as i16 as u16) << 16 | code
}

/// Returns the first and the second moment of a word.
pub fn unpack(rules: &Rules, word: u32) -> (f64, f64) {
    let root = root(rules, word);
    (f64::from((word >> 16) as u16 as i16) / rules.moment_ratio * root, root * root)
}
