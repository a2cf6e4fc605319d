//! Exposure of a photo: the picture that the loss sees, and its gradient (glsl/include/exposure.glsl).

/// The rows of a photo: ln of the gains, two of shares.
pub type ExposureRows = [[f64; 3]; 3];

/// Largest share that a channel takes from another one.
const CHANNEL_SHARE_MAX: f64 = 0.24;

/// Returns gains and shares of a channel.
fn channel_exposure(rows: &ExposureRows, k: usize) -> (f64, [f64; 2]) {
    (rows[0][k].exp(), [rows[1][k], rows[2][k]].map(|x| x / (1.0 + x.abs() / CHANNEL_SHARE_MAX)))
}

/// Applies the photo's exposure to a picture.
pub fn exposed(image: &[[f64; 3]], rows: &ExposureRows) -> Vec<[f64; 3]> {
    let pixel = |c: &[f64; 3]| {
        [0, 1, 2].map(|k| {
            let (gain, [next, last]) = channel_exposure(rows, k);
            gain * (c[k] + next * (c[(k + 1) % 3] - c[k]) + last * (c[(k + 2) % 3] - c[k]))
        })
    };
    image.iter().map(pixel).collect()
}

/// Gradients with respect to picture and rows. `v` is the gradient of the exposed picture. Channels above 1 do not
/// count where `photo` is saturated. `prior` pulls the mean over all photos, `mean`, to 0.
pub fn backward(
    image: &[[f64; 3]],
    rows: &ExposureRows,
    (v, photo): (&[[f64; 3]], &[[f64; 3]]),
    (prior, mean): (f64, &ExposureRows),
) -> (Vec<[f64; 3]>, ExposureRows) {
    let exposed = exposed(image, rows);
    let mut v_rows = mean.map(|of| of.map(|mean| prior * mean));
    let mut v_image = vec![[0.0; 3]; v.len()];
    for (p, c) in image.iter().enumerate() {
        for k in 0..3 {
            if exposed[p][k] > 1.0 && photo[p][k] == 1.0 {
                continue;
            }
            let (gain, shares) = channel_exposure(rows, k);
            v_rows[0][k] += v[p][k] * exposed[p][k];
            v_image[p][k] += v[p][k] * gain * (1.0 - shares[0] - shares[1]);
            for (row, share) in [1, 2].into_iter().zip(shares) {
                let other = (k + row) % 3;
                let slope = (1.0 + rows[row][k].abs() / CHANNEL_SHARE_MAX).powi(-2);
                v_rows[row][k] += v[p][k] * gain * slope * (c[other] - c[k]);
                v_image[p][other] += v[p][k] * gain * share;
            }
        }
    }
    (v_image, v_rows)
}
