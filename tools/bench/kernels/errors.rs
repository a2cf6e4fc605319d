//! Errors of an image and its gradients relative to float64.

use super::mirror::Mirror;
use crate::measure::quantile;
use labelgs::reference::Row;
use labelgs::reference::model::{Group, flatten};
use serde::Serialize;
use std::collections::BTreeMap;

/// Elements below this share of the largest have no relative error.
const RELATIVE_FLOOR: f64 = 1e-6;

/// Absolute errors of the colours over all channels.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct ColourError {
    /// Largest.
    pub max: f64,
    /// 99.9 % quantile.
    pub p999: f64,
    /// Root mean square.
    pub rms: f64,
}

/// Errors of the gradients of a parameter group.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct GroupError {
    /// Largest error divided by the largest magnitude.
    pub max: f64,
    /// 99.9 % quantile of the relative errors of elements that are at least 1e-6 of the largest magnitude.
    pub p999: f64,
    /// Norm of the error divided by the norm of the gradient.
    pub rms: f64,
}

/// Errors of the gradients by all groups.
#[derive(Clone, Debug, Default, Serialize)]
pub struct GradientError {
    /// Name and error of each group.
    pub groups: BTreeMap<String, GroupError>,
    /// The largest of each measure over the groups.
    pub worst: GroupError,
}

/// Errors relative to a reference.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Errors {
    /// Pixels that were compared.
    pub pixels: usize,
    /// Gaussians whose gradients were compared.
    pub rows: usize,
    /// Of the image.
    pub colours: ColourError,
    /// Of the gradients.
    pub gradients: GradientError,
}

impl Errors {
    /// Returns true if all errors are finite.
    pub fn are_finite(&self) -> bool {
        let (colours, worst) = (&self.colours, &self.gradients.worst);
        [colours.max, colours.p999, colours.rms, worst.max, worst.p999, worst.rms].iter().all(|v| v.is_finite())
    }
}

/// Results of a step on a device.
pub struct Outcome {
    /// Image, [height, width].
    pub colours: Vec<[f64; 3]>,
    /// Gradients per Gaussian.
    pub rows: Vec<Row>,
}

/// Compares everything, or only pixels and rows whose decisions are farther than `sure` from flipping.
pub fn compare(outcome: &Outcome, mirror: &Mirror, sure: f64) -> Errors {
    let pixels = (0..mirror.colours.len()).filter(|&i| mirror.pixel_margins[i] >= sure);
    let differences: Vec<f64> =
        pixels.flat_map(|i| [0, 1, 2].map(|c| (outcome.colours[i][c] - mirror.colours[i][c]).abs())).collect();
    let rows: Vec<usize> = (0..mirror.rows.len()).filter(|&i| mirror.row_margins[i] >= sure).collect();
    let pick = |from: &[Row]| -> Vec<Row> { rows.iter().map(|&i| from[i]).collect() };
    Errors {
        pixels: differences.len() / 3,
        rows: rows.len(),
        colours: colours(differences),
        gradients: gradients(&pick(&outcome.rows), &pick(&mirror.rows)),
    }
}

/// Treats NaN as larger than any number.
fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || a > b { a } else { b }
}

fn colours(mut differences: Vec<f64>) -> ColourError {
    let square = differences.iter().map(|d| d * d).sum::<f64>() / differences.len().max(1) as f64;
    let max = differences.iter().copied().fold(0.0, larger);
    ColourError { max, p999: quantile(&mut differences, 0.999), rms: square.sqrt() }
}

fn gradients(actual: &[Row], expected: &[Row]) -> GradientError {
    let mut out = GradientError::default();
    for group in Group::ALL {
        let (actual, expected) = (flatten(actual, group), flatten(expected, group));
        let error = group_error(&actual, &expected);
        out.worst.max = larger(error.max, out.worst.max);
        out.worst.p999 = larger(error.p999, out.worst.p999);
        out.worst.rms = larger(error.rms, out.worst.rms);
        out.groups.insert(format!("{group:?}").to_lowercase(), error);
    }
    out
}

fn group_error(actual: &[f64], expected: &[f64]) -> GroupError {
    let largest = expected.iter().fold(0.0_f64, |most, e| most.max(e.abs()));
    if largest == 0.0 {
        let max = actual.iter().map(|a| a.abs()).fold(0.0, larger);
        return GroupError { max, p999: max, rms: max };
    }
    let pairs = || actual.iter().zip(expected);
    let max = pairs().map(|(a, e)| (a - e).abs()).fold(0.0, larger) / largest;
    let norm = |squares: f64| squares.sqrt();
    let rms = norm(pairs().map(|(a, e)| (a - e) * (a - e)).sum()) / norm(expected.iter().map(|e| e * e).sum());
    let mut relative: Vec<f64> =
        pairs().filter(|(_, e)| e.abs() >= RELATIVE_FLOOR * largest).map(|(a, e)| ((a - e) / e).abs()).collect();
    GroupError { max, p999: quantile(&mut relative, 0.999), rms }
}
