//! Comparisons. A failure names the element and the values; `tests/verify/comparisons.rs` makes each comparison fail.

use std::fmt::Debug;

/// Outcome of a comparison.
pub type Verdict = Result<Summary, String>;

/// Measured errors of a passed comparison; test tolerances are the worst observed error x 1.5.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Summary {
    /// Largest error in units of the tolerance.
    pub worst: f64,
    /// Index of the largest error.
    pub place: usize,
    /// Number of elements beyond the tolerance for an allowed reason.
    pub flips: usize,
    /// For gradients: the largest of norm, angle and bias in units of their bounds.
    pub whole: f64,
}

/// Absolute and relative bound: |a - e| <= absolute + relative |e|.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// Absolute part.
    pub absolute: f64,
    /// Part relative to the expected magnitude.
    pub relative: f64,
}

impl Tolerance {
    /// Returns the tolerance times a factor.
    pub fn times(self, factor: f64) -> Self {
        Self { absolute: self.absolute * factor, relative: self.relative * factor }
    }

    fn bound(&self, expected: f64) -> f64 {
        self.absolute + self.relative * expected.abs()
    }
}

fn same_length<A, B>(actual: &[A], expected: &[B]) -> Result<(), String> {
    if actual.len() == expected.len() {
        return Ok(());
    }
    Err(format!("{} elements, expected {}", actual.len(), expected.len()))
}

/// Returns the indices with a margin above `least`; an error unless they exceed a share of all. Decisions at other
/// indices may go either way.
pub fn sure(margins: impl IntoIterator<Item = f64>, least: f64, share: f64) -> Result<Vec<usize>, String> {
    let is_sure: Vec<bool> = margins.into_iter().map(|margin| margin > least).collect();
    let sure: Vec<usize> = (0..is_sure.len()).filter(|&place| is_sure[place]).collect();
    if sure.len() as f64 > share * is_sure.len() as f64 {
        return Ok(sure);
    }
    Err(format!("only {} of {} are far enough from all decisions", sure.len(), is_sure.len()))
}

/// Returns the values at some indices.
pub fn pick<T: Copy>(values: &[T], places: &[usize]) -> Vec<T> {
    places.iter().map(|&place| values[place]).collect()
}

/// Every element is equal.
pub fn exact<T: PartialEq + Debug>(actual: &[T], expected: &[T]) -> Verdict {
    same_length(actual, expected)?;
    let wrong: Vec<usize> = (0..actual.len()).filter(|&i| actual[i] != expected[i]).collect();
    match wrong.first() {
        None => Ok(Summary::default()),
        Some(&i) => Err(format!(
            "{} of {} elements differ, first at {i}: {:?}, expected {:?}",
            wrong.len(),
            actual.len(),
            actual[i],
            expected[i]
        )),
    }
}

/// Every element is within the tolerance; NaN never passes.
pub fn close(actual: &[f64], expected: &[f64], tolerance: Tolerance) -> Verdict {
    same_length(actual, expected)?;
    let mut summary = Summary::default();
    for (place, (&a, &e)) in actual.iter().zip(expected).enumerate() {
        let error = (a - e).abs() / tolerance.bound(e).max(f64::MIN_POSITIVE);
        if !error.is_finite() && a != e {
            return Err(format!("element {place}: {a}, expected {e}"));
        }
        if error > summary.worst {
            summary = Summary { worst: error, place, ..Summary::default() };
        }
    }
    if summary.worst > 1.0 {
        let (place, a) = (summary.place, actual[summary.place]);
        let e = expected[place];
        return Err(format!("element {place}: {a}, expected {e}: {:.3} times the tolerance", summary.worst));
    }
    Ok(summary)
}

/// Allowed deviations near a discontinuity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Band {
    /// Elements with a smaller margin may flip.
    pub width: f64,
    /// A flip changes an element by at most this.
    pub flip: f64,
    /// At most this share of all elements may flip, but at least one may.
    pub ratio: f64,
}

/// With fewer flips, their signs are not significant.
const FLIPS_MIN: usize = 12;

/// Tight bounds outside the band; inside it, a limited share of bounded flips, balanced between both directions.
/// `crossing(place, actual)` proves a flip: it returns true if the actual value is the result of the opposite decision.
pub fn close_with_band(
    actual: &[f64],
    expected: &[f64],
    margins: &[f64],
    (tolerance, band): (Tolerance, Band),
    crossing: impl Fn(usize, f64) -> bool,
) -> Verdict {
    same_length(actual, expected)?;
    same_length(margins, expected)?;
    let inner: Vec<usize> = (0..actual.len()).filter(|&i| margins[i] >= band.width).collect();
    let mut summary = close(&pick(actual, &inner), &pick(expected, &inner), tolerance)
        .map_err(|text| format!("outside the band ({} of {} elements): {text}", inner.len(), actual.len()))?;
    summary.place = inner.get(summary.place).copied().unwrap_or(0);

    let beyond = |i: usize| !((actual[i] - expected[i]).abs() <= tolerance.bound(expected[i]));
    let flips: Vec<usize> = (0..actual.len()).filter(|&i| !(margins[i] >= band.width) && beyond(i)).collect();
    for &i in &flips {
        let (a, e) = (actual[i], expected[i]);
        if !((a - e).abs() <= band.flip) {
            return Err(format!("element {i} in the band: {a}, expected {e}: more than a flip ({})", band.flip));
        }
        if !crossing(i, a) {
            return Err(format!("element {i} in the band: {a}, expected {e}: no crossing explains it"));
        }
    }
    let allowed = ((band.ratio * actual.len() as f64) as usize).max(1);
    if flips.len() > allowed {
        return Err(format!("{} flips among {} elements; {allowed} are allowed", flips.len(), actual.len()));
    }
    let up = flips.iter().filter(|&&i| actual[i] > expected[i]).count();
    if flips.len() >= FLIPS_MIN && (up * 5 < flips.len() || up * 5 > 4 * flips.len()) {
        return Err(format!("{} of {} flips go up: a bias, not rounding", up, flips.len()));
    }
    summary.flips = flips.len();
    Ok(summary)
}

/// Bounds of a gradient comparison.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GradientBounds {
    /// Bound per element; the absolute part is in units of the largest expected magnitude.
    pub element: Tolerance,
    /// Share of the elements that may exceed the element bound.
    pub outliers: f64,
    /// |a - e|_2 / |e|_2.
    pub norm: f64,
    /// 1 - cosine.
    pub angle: f64,
    /// |sum (a - e) sign(e)| / sum |e|: detects a small common factor even if every element passes.
    pub bias: f64,
}

/// Element bound with a limited share of outliers, and bounds on norm, angle and signed bias of the whole.
pub fn gradients(actual: &[f64], expected: &[f64], bounds: GradientBounds) -> Verdict {
    same_length(actual, expected)?;
    if let Some(i) = actual.iter().position(|a| !a.is_finite()) {
        return Err(format!("element {i} is {}", actual[i]));
    }
    let largest = expected.iter().fold(0.0_f64, |most, e| most.max(e.abs()));
    if largest == 0.0 {
        return close(actual, expected, Tolerance { absolute: 0.0, relative: 0.0 });
    }
    let element = Tolerance { absolute: bounds.element.absolute * largest, relative: bounds.element.relative };
    let mut summary = Summary::default();
    for (place, (a, e)) in actual.iter().zip(expected).enumerate() {
        let error = (a - e).abs() / element.bound(*e);
        summary.flips += usize::from(error > 1.0);
        if error > summary.worst {
            (summary.worst, summary.place) = (error, place);
        }
    }
    let place = summary.place;
    if summary.flips as f64 > bounds.outliers * actual.len() as f64 {
        return Err(format!(
            "{} of {} elements beyond the bound, worst at {place}: {} where {} is expected, {:.3} times the bound",
            summary.flips,
            actual.len(),
            actual[place],
            expected[place],
            summary.worst
        ));
    }
    summary.whole = whole(actual, expected, bounds)?;
    Ok(summary)
}

fn whole(actual: &[f64], expected: &[f64], bounds: GradientBounds) -> Result<f64, String> {
    let mut worst = 0.0_f64;
    let pairs = || actual.iter().zip(expected);
    let squared = |values: &[f64]| values.iter().map(|v| v * v).sum::<f64>();
    let (aa, ee) = (squared(actual), squared(expected));
    let norm = (pairs().map(|(a, e)| (a - e) * (a - e)).sum::<f64>() / ee).sqrt();
    let angle = 1.0 - pairs().map(|(a, e)| a * e).sum::<f64>() / (aa * ee).sqrt();
    let signed: f64 = pairs().map(|(a, e)| (a - e) * e.signum()).sum();
    let bias = signed.abs() / expected.iter().map(|e| e.abs()).sum::<f64>();
    for (name, value, bound) in
        [("norm", norm, bounds.norm), ("angle", angle, bounds.angle), ("bias", bias, bounds.bias)]
    {
        if !(value <= bound) {
            return Err(format!("{name} of the error is {value:.3e}, {bound:.3e} is allowed"));
        }
        worst = worst.max(value / bound);
    }
    Ok(worst)
}
