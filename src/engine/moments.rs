//! Packs and unpacks Adam moments on the host (glsl/include/moments_store.glsl).

use crate::shaders::constants::{MOMENT_FLOOR, MOMENT_LOG, MOMENT_RATIO};

/// Unpacks a word into both moments.
fn unpack(word: u32) -> (f32, f32) {
    let code = word & 0xffff;
    if code == 0 {
        return (0.0, 0.0);
    }
    let root = (code as f32 / MOMENT_LOG as f32 - MOMENT_FLOOR as f32).exp2();
    let ratio = (word as i32 >> 16) as f32 / MOMENT_RATIO;
    (ratio * root, root * root)
}

/// Packs both moments into a word, rounded to nearest.
fn pack((m, v): (f32, f32)) -> u32 {
    if v < f32::MIN_POSITIVE {
        return 0;
    }
    let code = (MOMENT_LOG as f32 * (v.log2() / 2.0 + MOMENT_FLOOR as f32)).round().clamp(1.0, 65_535.0) as u32;
    let (_, stored) = unpack(code);
    let ratio = (m / stored.sqrt() * MOMENT_RATIO).round().clamp(-32_767.0, 32_767.0);
    (ratio as i32 as u32) << 16 | code
}

/// Unpacks words into first and second moments.
pub(super) fn unpack_all(words: &[u32]) -> (Vec<f32>, Vec<f32>) {
    words.iter().map(|&word| unpack(word)).unzip()
}

/// Packs first and second moments.
pub(super) fn pack_all(first: &[f32], second: &[f32]) -> Vec<u32> {
    first.iter().copied().zip(second.iter().copied()).map(pack).collect()
}

#[cfg(test)]
mod tests {
    use super::{pack, unpack};

    #[test]
    fn words_that_come_again_are_the_same() {
        for word in [0, 1, 0x8001_0001, 0x7fff_ffff, 0x0123_4567, 0xfedc_ba98, 0xffff_0400] {
            assert_eq!(pack(unpack(word)), word, "{word:x}");
        }
    }

    #[test]
    fn moments_are_within_half_a_step() {
        for (m, v) in [(1e-9_f32, 1e-18_f32), (-3.5, 2.0), (7.2e-4, 1e-8), (0.0, 1e20), (1e-20, 1e-30)] {
            let (first, second) = unpack(pack((m, v)));
            // Half a step is 3.4e-4 of the root, so twice that of v; half a step of the ratio is 1.3e-4.
            assert!((second / v - 1.0).abs() < 7e-4 || v > 2e8, "{v} {second}");
            assert!((first - m).abs() <= 1.3e-4 * second.sqrt(), "{m} {first}");
        }
        assert_eq!(pack((0.0, 0.0)), 0);
        assert_eq!(unpack(0), (0.0, 0.0));
        // Values below the smallest step round up to it.
        assert_eq!(pack((0.0, 1e-36)), 1);
    }
}
