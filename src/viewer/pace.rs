//! The size of images while the camera moves, and the time that viewing may take from training.

use std::time::Duration;

/// Decay of the weight of a frame with each new frame: about the last twenty count.
const FRAME_DECAY: f64 = 0.95;
/// Ratio of the widths of two successive sizes.
const SIZE_RATIO: f64 = 1.12;
/// Number of smaller sizes, down to a quarter of the width.
const SIZE_LEVELS_MAX: i32 = 12;
/// An image becomes smaller if it is predicted to take longer than this share of the target.
const SHRINK_ABOVE: f64 = 1.25;
/// An image becomes larger if the larger one is predicted to take less than this share of the target.
const GROW_BELOW: f64 = 0.95;

/// A model of the time of a frame, a + b · pixels, and the size that follows from it. Splats are projected and sorted
/// at any size, so time per pixel alone would shrink the image further and further.
#[derive(Clone, Debug, Default)]
pub(super) struct Pace {
    /// Weighted sums of 1, x, y, x², xy, with x in megapixels and y in seconds.
    sums: [f64; 5],
    level: i32,
}

impl Pace {
    pub(super) fn note(&mut self, pixels: f64, seconds: f64) {
        let x = pixels / 1e6;
        for (sum, value) in self.sums.iter_mut().zip([1.0, x, seconds, x * x, x * seconds]) {
            *sum = *sum * FRAME_DECAY + value;
        }
    }

    /// Returns the predicted time of a frame, s; 0 before the first one.
    pub(super) fn predict(&self, pixels: f64) -> f64 {
        let [n, x, y, xx, xy] = self.sums;
        if n == 0.0 {
            return 0.0;
        }
        let (mean_x, mean_y) = (x / n, y / n);
        let (variance, covariance) = (xx / n - mean_x * mean_x, xy / n - mean_x * mean_y);
        // Frames of one size cannot separate a from b, so half of the time is attributed to the pixels.
        let slope = if variance > 1e-4 * mean_x * mean_x { covariance / variance } else { 0.5 * mean_y / mean_x };
        // Neither part can be negative.
        let slope = slope.clamp(0.0, mean_y / mean_x);
        mean_y + slope * (pixels / 1e6 - mean_x)
    }

    /// Returns the share of the full width and height for a moving image that should take `target` seconds.
    pub(super) fn scale(&mut self, full_pixels: f64, target: f64) -> f64 {
        let time = |level: i32| self.predict(full_pixels * side(level) * side(level));
        if time(self.level) > SHRINK_ABOVE * target {
            self.level = (self.level..SIZE_LEVELS_MAX).find(|&level| time(level) <= target).unwrap_or(SIZE_LEVELS_MAX);
        } else if self.level > 0 && time(self.level - 1) < GROW_BELOW * target {
            self.level -= 1;
        }
        side(self.level)
    }
}

/// Returns the share of the full width at a level. `powi` may differ in its last bit from one place of the program to
/// another.
fn side(level: i32) -> f64 {
    (0..level).fold(1.0, |side, _| side / SIZE_RATIO)
}

/// The rate of the line to a client, and whether its moving images are worth a lossy compression.
#[derive(Clone, Debug, Default)]
pub(super) struct Line {
    /// Bytes per second.
    rate: f64,
    is_slow: bool,
}

impl Line {
    /// Notes that a frame was acknowledged.
    pub(super) fn note(&mut self, bytes: usize, after: Duration) {
        let rate = bytes as f64 / after.as_secs_f64().max(1e-4);
        self.rate = if self.rate == 0.0 { rate } else { 0.8 * self.rate + 0.2 * rate };
    }

    /// Returns true if a lossless image of so many pixels would take longer than `target` seconds to arrive.
    pub(super) fn is_slow(&mut self, pixels: f64, target: f64) -> bool {
        if self.rate > 0.0 {
            // Fast PNGs of photos take about 1.5 bytes per pixel.
            let time = 1.5 * pixels / self.rate;
            self.is_slow = if self.is_slow { time > 0.5 * target } else { time > 1.5 * target };
        }
        self.is_slow
    }
}

/// Bounds the share of time that viewing takes from a training.
#[derive(Clone, Debug)]
pub(super) struct Budget {
    share: f64,
    /// Seconds that viewing may take now; negative after a frame that took longer.
    credit: f64,
}

/// Maximum time for viewing that accumulates without viewing, s.
const CREDIT_MAX: f64 = 0.5;

impl Budget {
    /// Makes a budget of a share from 0 to 1.
    pub(super) fn new(share: f32) -> Self {
        Self { share: f64::from(share), credit: 0.0 }
    }

    pub(super) fn set_share(&mut self, share: f32) {
        self.share = f64::from(share.clamp(0.0, 1.0));
    }

    pub(super) fn share(&self) -> f64 {
        self.share
    }

    /// Notes time that went into the training.
    pub(super) fn trained(&mut self, time: Duration) {
        // A share of 1 would never train; it means that viewing never waits.
        let gain = time.as_secs_f64() * self.share / (1.0 - self.share).max(1e-3);
        self.credit = (self.credit + gain).min(CREDIT_MAX);
    }

    /// Notes time that went into viewing.
    pub(super) fn viewed(&mut self, time: Duration) {
        self.credit -= time.as_secs_f64();
    }

    /// Returns true if viewing may take the next turn.
    pub(super) fn allows(&self) -> bool {
        self.share > 0.0 && self.credit >= 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs frames whose true time is a + b · pixels with noise, and returns the scales.
    fn run(a: f64, b: f64, target: f64) -> Vec<f64> {
        let (full, mut pace) = (1e6, Pace::default());
        (0..200)
            .map(|frame| {
                let scale = pace.scale(full, target);
                let noise = 1.0 + 0.08 * f64::from((frame * 7919) % 13 - 6) / 6.0;
                pace.note(full * scale * scale, (a + b * full * scale * scale / 1e6) * noise);
                scale
            })
            .collect()
    }

    #[test]
    fn the_size_settles() {
        for (a, b) in [(0.005, 0.02), (0.03, 0.4), (0.05, 0.05), (0.01, 2.0), (0.2, 0.3)] {
            let scales = run(a, b, 0.08);
            let late = &scales[100..];
            let changes = late.windows(2).filter(|pair| pair[0] != pair[1]).count();
            assert!(changes <= 2, "a {a}, b {b}: {changes} changes in {late:?}");
            let (scale, floor) = (late[99], side(SIZE_LEVELS_MAX));
            let time = |scale: f64| a + b * scale * scale;
            assert!(time(scale) < 0.08 * 1.4 || scale == floor, "a {a}, b {b}: {scale}");
            assert!(scale == 1.0 || time(scale * SIZE_RATIO) > 0.08 * 0.7, "a {a}, b {b}: {scale} could be larger");
        }
    }

    #[test]
    fn a_fixed_cost_does_not_shrink_the_picture_to_nothing_at_once() {
        // 60 ms of the 80 do not depend on the size.
        let scales = run(0.06, 0.02, 0.08);
        assert!(scales[199] > 0.9, "{scales:?}");
    }

    #[test]
    fn viewing_takes_its_share_and_no_more() {
        for share in [0.1_f32, 0.3, 0.5, 0.9] {
            let mut budget = Budget::new(share);
            let (mut viewing, mut training) = (0.0, 0.0);
            for _ in 0..4000 {
                budget.trained(Duration::from_millis(20));
                training += 0.02;
                while budget.allows() {
                    budget.viewed(Duration::from_millis(70));
                    viewing += 0.07;
                }
            }
            let found = viewing / (viewing + training);
            assert!((found - f64::from(share)).abs() < 0.01, "{share}: {found}");
        }
        let mut none = Budget::new(0.0);
        none.trained(Duration::from_secs(100));
        assert!(!none.allows());
    }

    #[test]
    fn a_slow_line_is_told_from_a_fast_one() {
        let mut line = Line::default();
        assert!(!line.is_slow(3e5, 0.08));
        (0..50).for_each(|_| line.note(400_000, Duration::from_millis(8)));
        assert!(!line.is_slow(3e5, 0.08));
        (0..50).for_each(|_| line.note(400_000, Duration::from_millis(900)));
        assert!(line.is_slow(3e5, 0.08));
    }
}
