//! Photo loss (L1 and SSIM) and label loss, with their gradients with respect to the image.

use super::Rules;
use super::blend::Upstream;

/// A photo with its valid pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct Photo {
    /// Width and height, px.
    pub size: (usize, usize),
    /// `[height, width]`, linear 0 to 1.
    pub colours: Vec<[f64; 3]>,
    /// `[height, width]`; false for pixels without a source in the photo.
    pub valid: Vec<bool>,
}

impl Photo {
    /// Three times the number of valid pixels: the denominator of every loss.
    pub fn elements(&self) -> f64 {
        3.0 * self.valid.iter().filter(|&&valid| valid).count() as f64
    }
}

/// A loss with its gradient with respect to the image.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Loss {
    /// Mean absolute difference.
    pub l1: f64,
    /// Mean structural similarity.
    pub ssim: f64,
    /// Weighted sum, the training objective.
    pub value: f64,
    /// Gradient of `value` with respect to the image, `[height, width]`.
    pub v_image: Vec<[f64; 3]>,
    /// Gradient of `value` with respect to the opacity, `[height, width]`.
    pub v_alpha: Vec<f64>,
    /// Smallest absolute difference of a pixel's channels: distance to the kink of L1, `[height, width]`.
    pub margins: Vec<f64>,
}

impl Loss {
    fn empty(pixels: usize) -> Self {
        Self {
            v_image: vec![[0.0; 3]; pixels],
            v_alpha: vec![0.0; pixels],
            margins: vec![f64::INFINITY; pixels],
            ..Self::default()
        }
    }

    /// The gradient in the form that blending takes.
    pub fn upstream(&self) -> Upstream {
        Upstream { colours: self.v_image.clone(), alphas: self.v_alpha.clone() }
    }

    /// Smallest margin of all pixels.
    pub fn margin(&self) -> f64 {
        self.margins.iter().copied().fold(f64::INFINITY, f64::min)
    }
}

/// Gaussian window of unit sum, `[2 reach + 1]`.
pub fn window(rules: &Rules) -> Vec<f64> {
    let reach = rules.ssim_reach as f64;
    let raw: Vec<f64> = (0..=2 * rules.ssim_reach)
        .map(|i| (-(i as f64 - reach).powi(2) / (2.0 * rules.ssim_sigma.powi(2))).exp())
        .collect();
    let sum: f64 = raw.iter().sum();
    raw.iter().map(|v| v / sum).collect()
}

/// Window mean of a plane, with zeros outside. The window is symmetric, so this function is its own adjoint.
pub fn blur(plane: &[f64], (width, height): (usize, usize), window: &[f64]) -> Vec<f64> {
    let reach = (window.len() / 2) as isize;
    let along = |plane: &[f64], horizontal: bool| -> Vec<f64> {
        let at = |x: isize, y: isize| {
            let inside = x >= 0 && y >= 0 && x < width as isize && y < height as isize;
            if inside { plane[y as usize * width + x as usize] } else { 0.0 }
        };
        let mean = |index: usize| {
            let (x, y) = ((index % width) as isize, (index / width) as isize);
            let tap = |(i, weight): (usize, &f64)| {
                let offset = i as isize - reach;
                weight * if horizontal { at(x + offset, y) } else { at(x, y + offset) }
            };
            window.iter().enumerate().map(tap).sum()
        };
        (0..width * height).map(mean).collect()
    };
    along(&along(plane, true), false)
}

/// Window means of two planes, and the four factors of SSIM.
struct Moments {
    mu_x: Vec<f64>,
    mu_y: Vec<f64>,
    /// 2 mx my + C1.
    luminance: Vec<f64>,
    /// 2 sxy + C2.
    contrast: Vec<f64>,
    /// mx^2 + my^2 + C1.
    energy: Vec<f64>,
    /// sxx + syy + C2.
    spread: Vec<f64>,
}

fn ssim_moments(rules: &Rules, size: (usize, usize), x: &[f64], y: &[f64]) -> Moments {
    let window = window(rules);
    let mean = |a: &[f64], b: &[f64]| -> Vec<f64> {
        let product: Vec<f64> = a.iter().zip(b).map(|(a, b)| a * b).collect();
        blur(&product, size, &window)
    };
    let (mu_x, mu_y) = (blur(x, size, &window), blur(y, size, &window));
    let (xx, yy, xy) = (mean(x, x), mean(y, y), mean(x, y));
    let each = |f: &dyn Fn(usize) -> f64| (0..x.len()).map(f).collect::<Vec<f64>>();
    Moments {
        luminance: each(&|i| 2.0 * mu_x[i] * mu_y[i] + rules.ssim_c1),
        contrast: each(&|i| 2.0 * (xy[i] - mu_x[i] * mu_y[i]) + rules.ssim_c2),
        energy: each(&|i| mu_x[i] * mu_x[i] + mu_y[i] * mu_y[i] + rules.ssim_c1),
        spread: each(&|i| (xx[i] - mu_x[i] * mu_x[i]) + (yy[i] - mu_y[i] * mu_y[i]) + rules.ssim_c2),
        mu_x,
        mu_y,
    }
}

impl Moments {
    fn ssim(&self, i: usize) -> f64 {
        self.luminance[i] * self.contrast[i] / (self.energy[i] * self.spread[i])
    }
}

/// SSIM of two planes at each pixel.
pub fn ssim(rules: &Rules, size: (usize, usize), x: &[f64], y: &[f64]) -> Vec<f64> {
    let moments = ssim_moments(rules, size, x, y);
    (0..x.len()).map(|i| moments.ssim(i)).collect()
}

/// Gradient with respect to the first plane, given the gradient of the map.
pub fn ssim_backward(rules: &Rules, size: (usize, usize), x: &[f64], y: &[f64], v_map: &[f64]) -> Vec<f64> {
    let m = ssim_moments(rules, size, x, y);
    // Derivatives with respect to the mean, mean square and mean product of x, treated as independent quantities.
    let v_mu = |i: usize| {
        let below = m.energy[i] * m.spread[i];
        let by_means = 2.0 * m.mu_y[i] * (m.contrast[i] - m.luminance[i]) / below;
        v_map[i] * (by_means - 2.0 * m.mu_x[i] * m.ssim(i) * (1.0 / m.energy[i] - 1.0 / m.spread[i]))
    };
    let v_xx = |i: usize| -v_map[i] * m.ssim(i) / m.spread[i];
    let v_xy = |i: usize| v_map[i] * 2.0 * m.luminance[i] / (m.energy[i] * m.spread[i]);
    let window = window(rules);
    let spread = |f: &dyn Fn(usize) -> f64| blur(&(0..x.len()).map(f).collect::<Vec<_>>(), size, &window);
    let (b_mu, b_xx, b_xy) = (spread(&v_mu), spread(&v_xx), spread(&v_xy));
    (0..x.len()).map(|i| b_mu[i] + 2.0 * x[i] * b_xx[i] + y[i] * b_xy[i]).collect()
}

/// Sign: -1, 0 or 1.
pub fn sign(value: f64) -> f64 {
    if value == 0.0 { 0.0 } else { value.signum() }
}

/// 0.8 L1 + 0.2 (1 - SSIM) over the valid pixels; both images are 0 elsewhere.
pub fn photo_loss(rules: &Rules, image: &[[f64; 3]], photo: &Photo) -> Loss {
    let elements = photo.elements();
    let mut loss = Loss::empty(image.len());
    if elements == 0.0 {
        return loss;
    }
    let valid: Vec<f64> = photo.valid.iter().map(|&v| f64::from(u8::from(v))).collect();
    for channel in 0..3 {
        let plane = |colours: &[[f64; 3]]| -> Vec<f64> {
            colours.iter().zip(&valid).map(|(colour, valid)| if *valid > 0.0 { colour[channel] } else { 0.0 }).collect()
        };
        let (x, y) = (plane(image), plane(&photo.colours));
        let map = ssim(rules, photo.size, &x, &y);
        let v_ssim = ssim_backward(rules, photo.size, &x, &y, &valid);
        for i in (0..image.len()).filter(|&i| photo.valid[i]) {
            let difference = x[i] - y[i];
            loss.l1 += difference.abs() / elements;
            loss.ssim += map[i] / elements;
            loss.margins[i] = loss.margins[i].min(difference.abs());
            loss.v_image[i][channel] = (rules.l1_weight * sign(difference) - rules.dssim_weight * v_ssim[i]) / elements;
        }
    }
    loss.value = rules.l1_weight * loss.l1 + rules.dssim_weight * (1.0 - loss.ssim);
    loss
}

/// Bit of a label map's pixel near a contour; the label loss ignores such pixels.
pub const CONTOUR_BIT: u32 = 0x1_0000;

/// One object of a step: its label and the labels that hide it in this view.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectPixel {
    /// Label of the object, not 0.
    pub label: u32,
    /// Labels in front of it; the label loss ignores their pixels.
    pub occluders: Vec<u32>,
    /// Relative weight of its loss.
    pub weight: f64,
}

/// |U_k (R_k - M_k I)|, plus the weighted excess of |U_k (alpha_k - M_k)| over a slack, over the valid pixels, times
/// the label weight.
/// `picture` is R_k over black and alpha_k.
pub fn label_loss(
    rules: &Rules,
    picture: (&[[f64; 3]], &[f64]),
    photo: &Photo,
    label_map: &[u32],
    slot: &ObjectPixel,
) -> Loss {
    let (image, alphas) = picture;
    let pixel_weight = rules.label_weight * slot.weight / photo.elements();
    let mut loss = Loss::empty(image.len());
    let says = |i: usize| label_map[i] & CONTOUR_BIT == 0 && !slot.occluders.contains(&label_map[i]);
    for i in (0..image.len()).filter(|&i| photo.valid[i] && says(i)) {
        let inside = label_map[i] == slot.label;
        for channel in 0..3 {
            let target = if inside { photo.colours[i][channel] } else { 0.0 };
            let difference = image[i][channel] - target;
            loss.l1 += difference.abs();
            loss.v_image[i][channel] = pixel_weight * sign(difference);
            // An untouched pixel outside the mask is 0 on both sides and stays 0, so it has no kink.
            if difference != 0.0 {
                loss.margins[i] = loss.margins[i].min(difference.abs());
            }
        }
        if !inside && label_map[i] != 0 {
            continue;
        }
        // Opacity is between 0 and 1, so the sign of the difference never changes.
        let difference = alphas[i] - f64::from(u8::from(inside));
        let off = (difference.abs() - rules.alpha_slack).max(0.0);
        loss.l1 += 3.0 * rules.label_alpha * off;
        if off > 0.0 {
            loss.v_alpha[i] = 3.0 * rules.label_alpha * pixel_weight * sign(difference);
        }
        if rules.label_alpha > 0.0 {
            loss.margins[i] = loss.margins[i].min((difference.abs() - rules.alpha_slack).abs());
        }
    }
    loss.value = pixel_weight * loss.l1;
    loss
}
