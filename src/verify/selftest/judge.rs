//! Compares the buffers of the device with the reference, pass by pass.

use super::compare::{
    Band, GradientBounds, Summary, Tolerance, Verdict, close, close_with_band, exact, gradients as compare_gradients,
};
use crate::verify::reference::adam::{Optimised, Rates};
use crate::verify::reference::blend::Blended;
use crate::verify::reference::lift::Labelled;
use crate::verify::reference::model::flatten;
use crate::verify::reference::splat::{Splat, SplatGradient};
use crate::verify::reference::{Group, Row};

/// Combines several verdicts.
pub fn all(verdicts: impl IntoIterator<Item = Verdict>) -> Verdict {
    let mut worst = Summary::default();
    for verdict in verdicts {
        let summary = verdict?;
        let (flips, whole) = (worst.flips + summary.flips, worst.whole.max(summary.whole));
        worst = if summary.worst > worst.worst { summary } else { worst };
        (worst.flips, worst.whole) = (flips, whole);
    }
    Ok(worst)
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
pub fn picture(actual: &[[f32; 4]], expected: &Blended, (tolerance, band): (Tolerance, Band)) -> Verdict {
    let wanted: Vec<f64> =
        expected.pixels.iter().flat_map(|p| [p.colour[0], p.colour[1], p.colour[2], p.transmittance]).collect();
    let actual: Vec<f64> = actual.as_flattened().iter().map(|&v| f64::from(v)).collect();
    let margins: Vec<f64> =
        expected.pixels.iter().flat_map(|pixel| std::iter::repeat_n(pixel.margins.image(), 4)).collect();
    close_with_band(&actual, &wanted, &margins, (tolerance, band), |_, _| true)
}

/// Compares label and weight of each pixel with a margin above `sure` (at least 95 % of all).
pub fn label_map(
    (ids, weights): (&[u16], &[f32]),
    expected: &[Labelled],
    (tolerance, sure): (Tolerance, f64),
) -> Verdict {
    let all = expected.len();
    let sure: Vec<usize> = (0..all).filter(|&i| expected[i].margin > sure).collect();
    if sure.len() * 100 < all * 95 {
        return Err(format!("only {} of {all} pixels are away from all decisions", sure.len()));
    }
    let labels: (Vec<u32>, Vec<u32>) = sure.iter().map(|&i| (u32::from(ids[i]), expected[i].label)).unzip();
    let sums: (Vec<f64>, Vec<f64>) = sure.iter().map(|&i| (f64::from(weights[i]), expected[i].weight)).unzip();
    self::all([exact(&labels.0, &labels.1), close(&sums.0, &sums.1, tolerance)])
}

/// Compares gradients of splats with a margin above `sure` (at least 70 % of all), each kind of float separately.
pub fn splat_gradients(
    actual: &[SplatGradient],
    expected: &[SplatGradient],
    (margins, sure): (&[f64], f64),
    bounds: GradientBounds,
) -> Verdict {
    let sure: Vec<usize> = (0..actual.len().min(margins.len())).filter(|&i| margins[i] > sure).collect();
    if sure.len() * 10 <= actual.len() * 7 {
        return Err(format!("only {} of {} splats are away from all thresholds", sure.len(), actual.len()));
    }
    let pick = |of: &[SplatGradient], kind: usize| -> Vec<f64> {
        let floats = |v: &SplatGradient| match kind {
            0 => v.mean2d.to_vec(),
            1 => v.conic.to_vec(),
            2 => vec![v.opacity],
            _ => v.colour.to_vec(),
        };
        sure.iter().flat_map(|&i| floats(&of[i])).collect()
    };
    all(["mean2d", "conic", "opacity", "colour"].into_iter().enumerate().map(|(kind, name)| {
        compare_gradients(&pick(actual, kind), &pick(expected, kind), bounds).map_err(|text| format!("{name}: {text}"))
    }))
}

/// Compares rows of gradients, each group of floats separately, because their magnitudes are unrelated.
pub fn rows(actual: &[Row], expected: &[Row], degree: u32, bounds: GradientBounds) -> Verdict {
    let active = Group::ALL.into_iter().take(5 + degree as usize);
    all(active.map(|group| {
        compare_gradients(&flatten(actual, group), &flatten(expected, group), bounds)
            .map_err(|text| format!("{group:?}: {text}"))
    }))
}

/// Compares parameters and moments after an update. Errors are in units of the expected rounding error of an f32
/// parameter and of its update (a few roundings, and the host's bias correction, which uses the nearest f32 of 0.999:
/// 1.3e-5 of 1 - 0.999).
pub fn updates(actual: &[Optimised], expected: &[Optimised], rates: &Rates) -> Verdict {
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
