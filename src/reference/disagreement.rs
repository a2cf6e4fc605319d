//! The weight of wrong labels in the scene's picture, and its gradient by opacity.

use super::Rules;
use super::blend::{Trace, centre, trace};
use super::splat::Splat;

/// The disagreement of a picture with a mask.
#[derive(Clone, Debug, PartialEq)]
pub struct Disagreement {
    /// Weighted sum over the pixels.
    pub value: f64,
    /// Derivative of `value` by the opacity of each splat, with everything else fixed.
    pub v_opacities: Vec<f64>,
    /// Smallest gradient margin of the pixels in which each splat counts.
    pub margins: Vec<f64>,
}

/// Sums E(v) = sum_i w_i [label of i is not L] + T [L is not 0] over the pixels v with a label L and its weight;
/// unlabelled pixels are left out. `labels` is by Gaussian, `pixels` is `[height, width]`.
pub fn disagreement(
    rules: &Rules,
    splats: &[Splat],
    labels: &[u32],
    size: (usize, usize),
    pixels: &[Option<(u32, f64)>],
) -> Disagreement {
    summed(rules, splats, size, |index, ray, out| {
        if let Some((own, weight)) = pixels[index] {
            let differs = |splat: &Splat| f64::from(u8::from(labels[splat.gaussian] != own));
            let open = f64::from(u8::from(own != 0));
            add_ray(out, splats, ray, differs, (open, rules.label_weight * weight));
        }
    })
}

/// Sums E(v) = sum_i w_i min(|z_i / z - 1|, 1) + T over the pixels v with a known depth z. `inverse` has 1 / z, or 0 if
/// unknown, `[height, width]`; `weight` is the weight of a pixel.
pub fn depth_error(
    rules: &Rules,
    splats: &[Splat],
    size: (usize, usize),
    inverse: &[f64],
    weight: f64,
) -> Disagreement {
    summed(rules, splats, size, |index, ray, out| {
        let inverse = inverse[index];
        if inverse > 0.0 {
            let off = |splat: &Splat| (splat.depth * inverse - 1.0).abs().min(1.0);
            add_ray(out, splats, ray, off, (1.0, weight));
        }
    })
}

/// Sums what `add` returns for the ray of each pixel of a picture.
fn summed(
    rules: &Rules,
    splats: &[Splat],
    (width, height): (usize, usize),
    add: impl Fn(usize, &Trace, &mut Disagreement),
) -> Disagreement {
    let count = splats.len();
    let mut out = Disagreement { value: 0.0, v_opacities: vec![0.0; count], margins: vec![f64::INFINITY; count] };
    for index in 0..width * height {
        let ray = trace(rules, splats.iter().enumerate(), centre(index, width));
        for contribution in &ray.contributions {
            let least = &mut out.margins[contribution.splat];
            *least = least.min(ray.margins.gradient());
        }
        add(index, &ray, &mut out);
    }
    out
}

/// Adds a ray: dE/d alpha_i = T_i d_i - (everything behind i) / (1 - alpha_i).
fn add_ray(
    out: &mut Disagreement,
    splats: &[Splat],
    ray: &Trace,
    differs: impl Fn(&Splat) -> f64,
    (open, weight): (f64, f64),
) {
    let mut behind = ray.transmittance * open;
    for contribution in ray.contributions.iter().rev() {
        let splat = &splats[contribution.splat];
        let own = differs(splat);
        let v_alpha = contribution.transmittance * own - behind / (1.0 - contribution.alpha);
        behind += contribution.weight() * own;
        if !contribution.clamped {
            out.v_opacities[contribution.splat] += weight * contribution.alpha / splat.opacity * v_alpha;
        }
    }
    out.value += weight * behind;
}
