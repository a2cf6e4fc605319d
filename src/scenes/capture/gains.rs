//! The brightness of photos relative to each other, from shared points.
//!
//! A photo shows a point with the point's colour times the photo's gain. Both are found together by minimising the sum
//! of absolute differences of logarithms. So a photo is compared with the mean exposure of all photos, whatever the
//! exposure of its neighbours.

use super::shown_points::{Mark, ShownPoints};
use labelgs_scene::stage::Stage;
use labelgs_scene::{Result, View, parallel};
use rayon::prelude::*;

/// Fewest shared points for a gain.
const POINTS_MIN: usize = 20;
/// Darker and brighter pixels carry no information about exposure.
const BRIGHTNESS_MIN: f64 = 0.04;
const BRIGHTNESS_MAX: f64 = 0.95;
/// Iterations of reweighted least squares, and of conjugate gradients in each.
const REWEIGHTING_ROUNDS: usize = 15;
const GRADIENT_STEPS: usize = 60;
/// Smaller differences of logarithms have equal weight.
const DIFFERENCE_MIN: f64 = 0.02;
/// Weight of a gain of 1, against 1 / |difference| per point, so that a few inconsistent points do not determine a
/// gain.
const PRIOR_WEIGHT: f64 = 100.0;

/// Brightness of a photo relative to the mean of all photos.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Gains {
    pub(super) grey: f64,
    /// Red, green, blue.
    pub(super) channels: [f64; 3],
}

/// Logarithms of grey, red, green and blue of a point in a photo.
type Sample = (usize, [f64; 4]);

fn samples(view: &View, marks: &[Mark]) -> Result<Vec<Sample>> {
    let Some(photo) = &view.photo else { return Ok(Vec::new()) };
    let photo = photo.get()?;
    let sample = |&(point, pixel): &Mark| {
        let (x, y) = ((pixel.x as u32).min(photo.width - 1), (pixel.y as u32).min(photo.height - 1));
        let texel = photo.rgba[(y * photo.width + x) as usize];
        let [r, g, b] = [texel[0], texel[1], texel[2]].map(|value| f64::from(value) / 255.0);
        let values = [super::photos::grey(texel), r, g, b];
        let tells = texel[3] == 255 && values.iter().all(|value| (BRIGHTNESS_MIN..=BRIGHTNESS_MAX).contains(value));
        tells.then(|| (point, values.map(f64::ln)))
    };
    Ok(marks.iter().filter_map(sample).collect())
}

/// Returns the gains of each photo, or `None` if it shares too few points. Uses a sample of the points.
pub(super) fn gains(views: &[&View], shown: &ShownPoints) -> Result<Vec<Option<Gains>>> {
    let (points, marks) = shown.sample();
    let of_photo = |index: usize| samples(views[index], &marks[index]);
    let samples = parallel::map_bounded(
        "comparing the brightness of photos",
        views.len(),
        parallel::views_at_once(views.iter().copied()),
        of_photo,
    );
    let samples: Vec<Vec<Sample>> = samples.into_iter().collect::<Result<_>>()?;
    let _stage = Stage::new("finding the exposures of photos", 0);
    let channels: Vec<Vec<Option<f64>>> =
        (0..4).into_par_iter().map(|channel| relative_gains(&samples, points, channel)).collect();
    let of_view = |view: usize| {
        let [grey, red, green, blue] = [0, 1, 2, 3].map(|channel: usize| channels[channel][view]);
        Some(Gains { grey: grey?, channels: [red?, green?, blue?] })
    };
    Ok((0..views.len()).map(of_view).collect())
}

/// A point in a photo: the logarithm of its brightness, and its weight.
struct Entry {
    view: usize,
    point: usize,
    value: f64,
    weight: f64,
}

/// Returns the weighted mean over the entries of each point.
fn point_means(entries: &[Entry], points: usize, of: impl Fn(&Entry) -> f64) -> Vec<f64> {
    let mut sums = vec![(0.0, 0.0); points];
    for entry in entries {
        sums[entry.point].0 += entry.weight * of(entry);
        sums[entry.point].1 += entry.weight;
    }
    sums.into_iter().map(|(sum, weight)| if weight > 0.0 { sum / weight } else { 0.0 }).collect()
}

/// Returns the weighted sum over each view's entries of the difference from their point's mean, plus the prior's term.
fn residual_sums(entries: &[Entry], points: usize, logs: &[f64], of: impl Fn(&Entry) -> f64) -> Vec<f64> {
    let means = point_means(entries, points, &of);
    let mut sums: Vec<f64> = logs.iter().map(|log| PRIOR_WEIGHT * log).collect();
    entries.iter().for_each(|entry| sums[entry.view] += entry.weight * (of(entry) - means[entry.point]));
    sums
}

/// Minimises the weighted squares over the gains by conjugate gradients, with the points' colours eliminated.
fn descend(entries: &[Entry], points: usize, logs: &mut [f64]) {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let less: Vec<f64> = logs.iter().map(|log| -log).collect();
    let mut residual = residual_sums(entries, points, &less, |entry| entry.value + less[entry.view]);
    let (mut direction, mut square) = (residual.clone(), dot(&residual, &residual));
    for _ in 0..GRADIENT_STEPS {
        let along = residual_sums(entries, points, &direction, |entry| direction[entry.view]);
        let curvature = dot(&direction, &along);
        if square <= 1e-16 || curvature <= 0.0 {
            return;
        }
        let step = square / curvature;
        logs.iter_mut().zip(&direction).for_each(|(log, d)| *log += step * d);
        residual.iter_mut().zip(&along).for_each(|(of, a)| *of -= step * a);
        let next = dot(&residual, &residual);
        direction.iter_mut().zip(&residual).for_each(|(d, r)| *d = r + next / square * *d);
        square = next;
    }
}

/// Returns the gain of each photo in a channel. The geometric mean of all gains is 1.
fn relative_gains(samples: &[Vec<Sample>], points: usize, channel: usize) -> Vec<Option<f64>> {
    let mut shown_by = vec![0_u32; points];
    samples.iter().flatten().for_each(|&(point, _)| shown_by[point] += 1);
    let shared = |view: usize| samples[view].iter().filter(|&&(point, _)| shown_by[point] >= 2);
    let known: Vec<bool> = (0..samples.len()).map(|view| shared(view).count() >= POINTS_MIN).collect();
    let entry = |view: usize, &(point, values): &Sample| Entry { view, point, value: values[channel], weight: 1.0 };
    let mut entries: Vec<Entry> = (0..samples.len())
        .filter(|&view| known[view])
        .flat_map(|view| shared(view).map(move |sample| entry(view, sample)))
        .collect();
    let mut logs = vec![0.0; samples.len()];
    for _ in 0..REWEIGHTING_ROUNDS {
        descend(&entries, points, &mut logs);
        let means = point_means(&entries, points, |entry| entry.value - logs[entry.view]);
        for entry in &mut entries {
            entry.weight = 1.0 / (entry.value - logs[entry.view] - means[entry.point]).abs().max(DIFFERENCE_MIN);
        }
    }
    let count = known.iter().filter(|&&known| known).count().max(1) as f64;
    let mean = logs.iter().sum::<f64>() / count;
    logs.into_iter().zip(known).map(|(log, known)| known.then(|| (log - mean).exp())).collect()
}

#[cfg(test)]
mod tests {
    use super::relative_gains;

    /// Photos in a row, each of which shares points with the next two: gains are relative to all photos, not to
    /// neighbours. The pull to 1 does not count with as many points.
    #[test]
    fn gains_of_a_chain_are_those_that_made_it() {
        let gains = [0.7_f64, 0.75, 0.8, 1.0, 1.2, 1.3, 1.4];
        let colour = |point: usize| 0.2 + 0.01 * (point % 31) as f64;
        let photo = |view: usize| {
            let shown = (300 * view..300 * view + 900).filter(|point| !(point % 7 == 0 && view == 3));
            shown.map(|point| (point, [(gains[view] * colour(point)).ln(); 4])).collect()
        };
        let samples: Vec<Vec<_>> = (0..gains.len()).map(photo).chain([Vec::new()]).collect();
        let found = relative_gains(&samples, 3000, 0);
        let mean = gains.iter().map(|gain| gain.ln()).sum::<f64>() / gains.len() as f64;
        for (view, gain) in gains.iter().enumerate() {
            let expected = (gain.ln() - mean).exp();
            let gain = found[view].expect("a gain");
            assert!((gain / expected - 1.0).abs() < 0.02, "photo {view}: {gain}, expected {expected}");
        }
        assert_eq!(found[gains.len()], None, "a photo without points");
    }
}
