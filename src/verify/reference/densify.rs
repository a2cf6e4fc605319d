//! Clones, splits and removes Gaussians.

use super::project::{normalised, rotation, sigmoid};
use super::rules::wide;
use super::{Model, Row, Rules};
use crate::shaders::constants;
use glam::DVec3;

/// Input of densification.
#[derive(Clone, Debug, PartialEq)]
pub struct Population {
    /// Parameters and labels.
    pub model: Model,
    /// First moments, `[N]`.
    pub m: Vec<Row>,
    /// Second moments, `[N]`.
    pub u: Vec<Row>,
    /// Sum over views of the 2-D gradient's norm (NDC units), `[N]`.
    pub gradient_sum: Vec<f64>,
    /// Number of views that saw the Gaussian, `[N]`.
    pub gradient_count: Vec<f64>,
}

/// Origin of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// An unchanged row.
    Kept,
    /// A copy, directly after its parent.
    Clone,
    /// First (0) or second (1) child of a removed parent.
    Child(u32),
}

/// The population after densification.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Densified {
    /// Parameters and labels.
    pub model: Model,
    /// First moments.
    pub m: Vec<Row>,
    /// Second moments.
    pub u: Vec<Row>,
    /// (Earlier row, origin) of each row.
    pub origins: Vec<(usize, Origin)>,
    /// Distance of the nearest decision about each earlier row, relative to its threshold.
    pub margins: Vec<f64>,
}

fn largest_scale(row: &Row) -> f64 {
    row.scale.iter().fold(f64::NEG_INFINITY, |most, &s| most.max(s)).exp()
}

/// Child of a split, at `noise` standard deviations along the parent's axes.
pub fn split_child(rules: &Rules, parent: &Row, noise: [f64; 3]) -> Row {
    let offset = DVec3::from([0, 1, 2].map(|axis| parent.scale[axis].exp() * noise[axis]));
    let mean = DVec3::from(parent.mean) + rotation(normalised(parent.quat).0) * offset;
    Row { mean: mean.into(), scale: parent.scale.map(|s| s - rules.split_shrink.ln()), ..*parent }
}

/// Clones and splits by the mean gradient, then removes faint and (late) huge rows. The order is kept: a clone directly
/// follows its parent, children replace their parent. `normal(row, child, axis)` is a standard normal number.
pub fn densify(
    rules: &Rules,
    before: &Population,
    extent: f64,
    step: u32,
    normal: impl Fn(usize, u32, usize) -> f64,
) -> Densified {
    let mut out = Densified { margins: vec![f64::INFINITY; before.model.rows.len()], ..Densified::default() };
    out.model.sh_degree = before.model.sh_degree;
    for (index, row) in before.model.rows.iter().enumerate() {
        let count = before.gradient_count[index];
        let mean = if count > 0.0 { before.gradient_sum[index] / count } else { 0.0 };
        let (gradient, limit, scale) = (rules.densify_gradient, rules.percent_dense * extent, largest_scale(row));
        out.note(index, mean / gradient);
        let zero = Row::default();
        let moments = (before.m[index], before.u[index]);
        let label = before.model.labels[index];
        let rows = if mean < gradient {
            vec![(*row, moments, Origin::Kept)]
        } else if scale <= limit {
            out.note(index, scale / limit);
            vec![(*row, moments, Origin::Kept), (*row, (zero, zero), Origin::Clone)]
        } else {
            out.note(index, scale / limit);
            let child = |child: u32| {
                let noise = [0, 1, 2].map(|axis| normal(index, child, axis));
                (split_child(rules, row, noise), (zero, zero), Origin::Child(child))
            };
            vec![child(0), child(1)]
        };
        for (row, moments, origin) in rows {
            if out.survives(rules, index, &row, extent, step) {
                out.model.rows.push(row);
                out.model.labels.push(label);
                out.m.push(moments.0);
                out.u.push(moments.1);
                out.origins.push((index, origin));
            }
        }
    }
    out
}

/// Number of rows that each earlier row becomes: 0 removed, 1 kept, 2 cloned or split.
pub fn mark(rules: &Rules, before: &Population, extent: f64, step: u32) -> Vec<u32> {
    let mut counts = vec![0; before.model.rows.len()];
    let after = densify(rules, before, extent, step, |_, _, _| 0.0);
    after.origins.iter().for_each(|(parent, _)| counts[*parent] += 1);
    counts
}

/// Adds a view to the statistic: gradient norm and one view per visible Gaussian. Skips dropped gradients.
pub fn accumulate(population: &mut Population, gradient2d: &[f64], visible: &[bool]) {
    let counts = |index: &usize| visible[*index] && gradient2d[*index] < wide(constants::GRADIENT_MAX);
    for index in (0..visible.len()).filter(counts) {
        population.gradient_sum[index] += gradient2d[index];
        population.gradient_count[index] += 1.0;
    }
}

impl Densified {
    fn note(&mut self, index: usize, ratio: f64) {
        self.margins[index] = self.margins[index].min((ratio - 1.0).abs());
    }

    fn survives(&mut self, rules: &Rules, index: usize, row: &Row, extent: f64, step: u32) -> bool {
        let opacity = sigmoid(row.opacity);
        self.note(index, opacity / rules.prune_opacity);
        if opacity < rules.prune_opacity {
            return false;
        }
        if step <= rules.prune_scale_after {
            return true;
        }
        let ratio = largest_scale(row) / (rules.prune_scale * extent);
        self.note(index, ratio);
        ratio <= 1.0
    }
}

/// Limits the opacity to the reset's ceiling and zeroes its moments.
pub fn opacity_reset(rules: &Rules, row: &mut Row, m: &mut Row, u: &mut Row) {
    let ceiling = (rules.reset_opacity / (1.0 - rules.reset_opacity)).ln();
    row.opacity = row.opacity.min(ceiling);
    (m.opacity, u.opacity) = (0.0, 0.0);
}
