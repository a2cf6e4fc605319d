//! Random numbers for densification and packed moments; they depend only on seed, Gaussian and draw index.

fn pcg_hash(v: u32) -> u32 {
    let state = v.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    (word >> 22) ^ word
}

/// All bits of a draw.
pub fn hash(seed: u32, index: u32, draw: u32) -> u32 {
    pcg_hash(pcg_hash(pcg_hash(seed).wrapping_add(index)).wrapping_add(draw))
}

/// A number between 0 and 1, exclusive.
pub fn uniform_draw(seed: u32, index: u32, draw: u32) -> f64 {
    (f64::from(hash(seed, index, draw) >> 8) + 0.5) / 16_777_216.0
}

/// A standard normal number (Box and Muller; glsl/include/random.glsl).
pub fn normal_draw(seed: u32, index: u32, draw: u32) -> f64 {
    let radius = (-2.0 * uniform_draw(seed, index, 2 * draw).ln()).sqrt();
    radius * (std::f64::consts::TAU * uniform_draw(seed, index, 2 * draw + 1)).cos()
}
