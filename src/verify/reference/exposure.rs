//! Exposure of a photo: the picture that the loss sees, and its gradient.

/// Multiplies a picture by the gains of its photo, given as logarithms.
pub fn exposed(image: &[[f64; 3]], log_gains: [f64; 3]) -> Vec<[f64; 3]> {
    let gains = log_gains.map(f64::exp);
    image.iter().map(|colour| [0, 1, 2].map(|c| gains[c] * colour[c])).collect()
}

/// Gradients with respect to picture and ln gain. `v` is that with respect to the exposed picture, `photo` the photo: a
/// channel above 1 where the photo is saturated does not count. `prior` pulls the mean over all photos, `mean`, to 0.
pub fn backward(
    image: &[[f64; 3]],
    log_gains: [f64; 3],
    (v, photo): (&[[f64; 3]], &[[f64; 3]]),
    (prior, mean): (f64, [f64; 3]),
) -> (Vec<[f64; 3]>, [f64; 3]) {
    let exposed = exposed(image, log_gains);
    let counts = |p: usize, c: usize| !(exposed[p][c] > 1.0 && photo[p][c] == 1.0);
    let v: Vec<[f64; 3]> = (0..v.len()).map(|p| [0, 1, 2].map(|c| if counts(p, c) { v[p][c] } else { 0.0 })).collect();
    let sum = |c: usize| v.iter().zip(&exposed).map(|(v, colour)| v[c] * colour[c]).sum::<f64>();
    let of_gains = [0, 1, 2].map(|c| sum(c) + prior * mean[c]);
    (v.iter().map(|v| [0, 1, 2].map(|c| log_gains[c].exp() * v[c])).collect(), of_gains)
}
