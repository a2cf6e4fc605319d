//! Compares device buffers with the reference, pass by pass.

use super::compare::{
    Band, GradientBounds, Summary, Tolerance, Verdict, close, close_with_band, exact, gradients, pick, sure,
};
use crate::reference::adam::{AdamState, Rates};
use crate::reference::blend::BlendedImage;
use crate::reference::lift::PixelLabel;
use crate::reference::model::flatten;
use crate::reference::project::project_forward;
use crate::reference::splat::{Splat, SplatGradient};
use crate::reference::{Group, Model, Row, Rules};
use crate::scene::Camera;

/// Combines several verdicts.
pub fn combine(verdicts: impl IntoIterator<Item = Verdict>) -> Verdict {
    let mut worst = Summary::default();
    for verdict in verdicts {
        let summary = verdict?;
        let (flips, whole) = (worst.flips + summary.flips, worst.whole.max(summary.whole));
        worst = if summary.worst > worst.worst { summary } else { worst };
        (worst.flips, worst.whole) = (flips, whole);
    }
    Ok(worst)
}

/// Compares the device's splats with those of the reference for the same Gaussians.
pub fn projection(
    rules: &Rules,
    (camera, model): (&Camera, &Model),
    actual: &[Splat],
    tolerance: Tolerance,
) -> Verdict {
    let projected = |s: &Splat| project_forward(rules, camera, model, s.gaussian).map(|found| found.splat);
    let expected: Vec<Splat> = actual.iter().filter_map(projected).collect();
    if expected.len() < actual.len() {
        return Err(format!("{} splats do not count at any pixel", actual.len() - expected.len()));
    }
    splats(actual, &expected, tolerance)
}

/// Compares splats one by one. Shapes are compared relative to their size.
pub fn splats(actual: &[Splat], expected: &[Splat], tolerance: Tolerance) -> Verdict {
    let floats = |of: &[Splat]| of.iter().zip(expected).flat_map(|(s, e)| splat_floats(s, e)).collect::<Vec<_>>();
    close(&floats(actual), &floats(expected), tolerance)
}

/// Centre, shape relative to its size, log2 of the opacity, colour, depth.
fn splat_floats(splat: &Splat, scale: &Splat) -> [f64; 10] {
    let (size_a, size_c) = (scale.conic[0].sqrt(), scale.conic[2].sqrt());
    let [x, y] = splat.mean2d;
    // Far outside of the image, an error in px matters less.
    let [fx, fy] = scale.mean2d.map(|v| 1.0 + (v / 50.0).abs());
    let [a, b, c] = splat.conic;
    let [red, green, blue] = splat.colour;
    let shape = [a / (size_a * size_a), b / (size_a * size_c), c / (size_c * size_c)];
    [x / fx, y / fy, shape[0], shape[1], shape[2], splat.opacity.log2(), red, green, blue, splat.depth]
}

/// Compares colours and transmittance of each pixel; pixels with a decision in the band may flip.
pub fn picture(actual: &[[f32; 4]], expected: &BlendedImage, (tolerance, band): (Tolerance, Band)) -> Verdict {
    let wanted: Vec<f64> =
        expected.pixels.iter().flat_map(|p| [p.colour[0], p.colour[1], p.colour[2], p.transmittance]).collect();
    let actual: Vec<f64> = actual.as_flattened().iter().map(|&v| f64::from(v)).collect();
    let margins: Vec<f64> =
        expected.pixels.iter().flat_map(|pixel| std::iter::repeat_n(pixel.margins.image(), 4)).collect();
    close_with_band(&actual, &wanted, &margins, (tolerance, band), |_, _| true)
}

/// Compares label and weight of each pixel with a margin above `margin` (more than 95 % of all).
pub fn label_map(
    (ids, weights): (&[u16], &[f32]),
    expected: &[PixelLabel],
    (tolerance, margin): (Tolerance, f64),
) -> Verdict {
    let sure = sure(expected.iter().map(|pixel| pixel.margin), margin, 0.95)?;
    let labels: (Vec<u32>, Vec<u32>) = sure.iter().map(|&i| (u32::from(ids[i]), expected[i].label)).unzip();
    let sums: (Vec<f64>, Vec<f64>) = sure.iter().map(|&i| (f64::from(weights[i]), expected[i].weight)).unzip();
    combine([exact(&labels.0, &labels.1), close(&sums.0, &sums.1, tolerance)])
}

/// Compares gradients of splats with a margin above `margin` (more than 70 % of all), each kind of float separately.
pub fn splat_gradients(
    actual: &[SplatGradient],
    expected: &[SplatGradient],
    (margins, margin): (&[f64], f64),
    bounds: GradientBounds,
) -> Verdict {
    let sure = sure(margins.iter().copied(), margin, 0.7)?;
    let (actual, expected) = (pick(actual, &sure), pick(expected, &sure));
    let kinds: [(&str, fn(&SplatGradient) -> Vec<f64>); 4] = [
        ("mean2d", |v| v.mean2d.to_vec()),
        ("conic", |v| v.conic.to_vec()),
        ("opacity", |v| vec![v.opacity]),
        ("colour", |v| v.colour.to_vec()),
    ];
    combine(kinds.into_iter().map(|(name, floats)| {
        let of = |list: &[SplatGradient]| list.iter().flat_map(floats).collect::<Vec<f64>>();
        gradients(&of(&actual), &of(&expected), bounds).map_err(|text| format!("{name}: {text}"))
    }))
}

/// Compares rows of gradients, each group of floats separately, because their magnitudes are unrelated.
pub fn rows(actual: &[Row], expected: &[Row], degree: u32, bounds: GradientBounds) -> Verdict {
    let active = Group::ALL.into_iter().take(5 + degree as usize);
    combine(active.map(|group| {
        gradients(&flatten(actual, group), &flatten(expected, group), bounds)
            .map_err(|text| format!("{group:?}: {text}"))
    }))
}

/// Compares parameters and moments after an update. Errors are in units of the expected rounding error of an f32
/// parameter and of its update (a few roundings, and the host's bias correction, which uses the nearest f32 of 0.999:
/// 1.3e-5 of 1 - 0.999).
pub fn updates(actual: &[AdamState], expected: &[AdamState], rates: &Rates) -> Verdict {
    let mut pairs = (Vec::new(), Vec::new());
    for (a, e) in actual.iter().zip(expected) {
        let (a, e) = ([a.row, a.m, a.u].map(|r| r.floats()), [e.row, e.m, e.u].map(|r| r.floats()));
        for (group, rate) in Group::ALL.into_iter().zip(rates.0) {
            for i in group.range() {
                let of_m = 1e-6 * e[1][i].abs() + 3e-6 * e[2][i].sqrt(); // two terms that may cancel
                let units = [1e-7 * e[0][i].abs() + 1e-5 * rate, of_m + 1e-30, 1e-6 * e[2][i] + 1e-36];
                (0..3).for_each(|k| pairs.0.push((a[k][i] - e[k][i]) / units[k]));
                pairs.1.extend([0.0; 3]);
            }
        }
    }
    close(&pairs.0, &pairs.1, Tolerance { absolute: 1.0, relative: 0.0 })
}
