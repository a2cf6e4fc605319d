//! Structural similarity of 8-bit pictures with the defaults of scikit-image, for comparison with published numbers: a
//! uniform window of 7 x 7 px inside the image, sample covariance, data range 255, each channel alone.

/// Side of the window, px.
const WINDOW_SIDE_PX: usize = 7;
const C1: f64 = (0.01 * 255.0) * (0.01 * 255.0);
const C2: f64 = (0.03 * 255.0) * (0.03 * 255.0);

/// Converts a colour to 8 bits.
pub fn to_bytes(colour: [f32; 3]) -> [u8; 3] {
    // NaN becomes 0.
    colour.map(|value| (value * 255.0 + 0.5).clamp(0.0, 255.0) as u8)
}

/// Returns the mean over all windows and channels; `None` for pictures smaller than the window.
pub fn ssim8(a: &[[u8; 3]], b: &[[u8; 3]], width: usize, height: usize) -> Option<f64> {
    if width < WINDOW_SIDE_PX || height < WINDOW_SIDE_PX {
        return None;
    }
    let count = (width - WINDOW_SIDE_PX + 1) * (height - WINDOW_SIDE_PX + 1) * 3;
    let total: f64 = (0..3).map(|channel| channel_sum(a, b, width, height, channel)).sum();
    Some(total / count as f64)
}

fn channel_sum(a: &[[u8; 3]], b: &[[u8; 3]], width: usize, height: usize, channel: usize) -> f64 {
    // Summed-area tables of a, b, aa, bb and ab.
    let stride = width + 1;
    let mut sums = vec![[0_u64; 5]; stride * (height + 1)];
    for y in 0..height {
        let mut row = [0_u64; 5];
        for x in 0..width {
            let (p, q) = (u64::from(a[y * width + x][channel]), u64::from(b[y * width + x][channel]));
            for (sum, term) in row.iter_mut().zip([p, q, p * p, q * q, p * q]) {
                *sum += term;
            }
            let above = sums[y * stride + x + 1];
            sums[(y + 1) * stride + x + 1] = std::array::from_fn(|i| above[i] + row[i]);
        }
    }
    let window = |x: usize, y: usize| {
        let corner = |x: usize, y: usize| sums[y * stride + x];
        let (low, right, below, high) = (
            corner(x, y),
            corner(x + WINDOW_SIDE_PX, y),
            corner(x, y + WINDOW_SIDE_PX),
            corner(x + WINDOW_SIDE_PX, y + WINDOW_SIDE_PX),
        );
        let sum: [f64; 5] = std::array::from_fn(|i| (high[i] + low[i] - right[i] - below[i]) as f64);
        similarity(sum)
    };
    (0..=height - WINDOW_SIDE_PX).map(|y| (0..=width - WINDOW_SIDE_PX).map(|x| window(x, y)).sum::<f64>()).sum()
}

fn similarity(sums: [f64; 5]) -> f64 {
    let count = (WINDOW_SIDE_PX * WINDOW_SIDE_PX) as f64;
    let [p, q, pp, qq, pq] = sums.map(|sum| sum / count);
    let sample = count / (count - 1.0);
    let (var_p, var_q, cov) = (sample * (pp - p * p), sample * (qq - q * q), sample * (pq - p * q));
    (2.0 * p * q + C1) * (2.0 * cov + C2) / ((p * p + q * q + C1) * (var_p + var_q + C2))
}
