//! Clones, splits and removes Gaussians.

use super::blend::{Upstream, blend_backward};
use super::project::{normalised, rotation, sigmoid};
use super::rules::{GRADIENT_MAX, wide};
use super::splat::Splat;
use super::{Model, Row, Rules};
use glam::DVec3;
use labelgs_scene::Camera;

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
    /// Number of frozen rows at the end; their moments and statistics are meaningless.
    pub frozen: usize,
}

impl Population {
    /// Returns true for a frozen row.
    pub fn is_frozen(&self, index: usize) -> bool {
        index + self.frozen >= self.model.rows.len()
    }
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
pub struct DensifiedPopulation {
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

/// Child 0 or 1 of a split along the longest axis.
pub fn split_long_child(rules: &Rules, parent: &Row, child: u32) -> Row {
    let longest = (1..3).fold(0, |best, axis| if parent.scale[axis] > parent.scale[best] { axis } else { best });
    let side = if child == 0 { rules.split_offset } else { -rules.split_offset };
    let mut offset = DVec3::ZERO;
    offset[longest] = side * parent.scale[longest].exp();
    let mean = DVec3::from(parent.mean) + rotation(normalised(parent.quat).0) * offset;
    let shrink = |axis: usize| if axis == longest { rules.split_long } else { rules.split_others };
    let opacity = rules.split_opacity * sigmoid(parent.opacity);
    let scale = [0, 1, 2].map(|axis| parent.scale[axis] + shrink(axis).ln());
    Row { mean: mean.into(), scale, opacity: (opacity / (1.0 - opacity)).ln(), ..*parent }
}

/// Returns true if a Gaussian fogs the camera, or a camera on the way to `other`, given as centre and near plane. Also
/// returns the decision's margin.
pub fn is_near(rules: &Rules, camera: &Camera, other: Option<(DVec3, f64)>, row: &Row) -> (bool, f64) {
    let mean = DVec3::from(row.mean);
    let place = camera.to_camera(mean);
    let size = rules.free_size * place.length();
    let engulfs = largest_scale(row) - size;
    let own = before(rules, camera, [place, place], rules.near);
    let on_the_way =
        other.map(|(centre, near)| before(rules, camera, [place, camera.rotation * (mean - centre)], near));
    let slacks = [Some(engulfs / size), Some(own), on_the_way];
    let margin = slacks.iter().flatten().fold(f64::INFINITY, |least: f64, slack| least.min(slack.abs()));
    (slacks.iter().flatten().any(|&slack| slack >= 0.0), margin)
}

/// Returns how much of the path between two positions, in camera space, is before the near plane and inside the image
/// plus margin. Negative values say how far outside the path is.
fn before(rules: &Rules, camera: &Camera, places: [DVec3; 2], near: f64) -> f64 {
    let limits = |focal: f64, centre: f64, side: u32| {
        let (side, spare) = (f64::from(side), rules.jacobian_margin * 0.5 * f64::from(side));
        [(-spare - centre) / focal, (side + spare - centre) / focal]
    };
    let ([left, right], [top, bottom]) =
        (limits(camera.fx, camera.cx, camera.width), limits(camera.fy, camera.cy, camera.height));
    let [first, last] =
        places.map(|p| [p.z, near - p.z, p.x - left * p.z, right * p.z - p.x, p.y - top * p.z, bottom * p.z - p.y]);
    let (mut low, mut high, mut least) = (0.0_f64, 1.0_f64, f64::INFINITY);
    for (a, b) in first.into_iter().zip(last) {
        least = least.min(a.max(b));
        if (a < 0.0) != (b < 0.0) {
            let zero = a / (a - b);
            (low, high) = if a < 0.0 { (low.max(zero), high) } else { (low, high.min(zero)) };
        }
    }
    if least < 0.0 { least } else { (high - low).min(least) }
}

/// Clones and splits by the mean gradient, then removes faint and (late) huge rows. The order is kept: a clone directly
/// follows its parent, children replace their parent. `normal(row, child, axis)` is a standard normal number.
pub fn densify(
    rules: &Rules,
    before: &Population,
    extent: f64,
    step: u32,
    normal: impl Fn(usize, u32, usize) -> f64,
) -> DensifiedPopulation {
    let mut out =
        DensifiedPopulation { margins: vec![f64::INFINITY; before.model.rows.len()], ..DensifiedPopulation::default() };
    out.model.sh_degree = before.model.sh_degree;
    for (index, row) in before.model.rows.iter().enumerate() {
        if before.is_frozen(index) {
            out.push(before, index, (*row, (Row::default(), Row::default()), Origin::Kept));
            continue;
        }
        let count = before.gradient_count[index];
        if count >= rules.stat_near {
            continue;
        }
        let mean = if count > 0.0 { before.gradient_sum[index] / count } else { 0.0 };
        let (gradient, limit, scale) = (rules.densify_gradient, rules.percent_dense * extent, largest_scale(row));
        out.note(index, mean / gradient);
        let zero = Row::default();
        let moments = (before.m[index], before.u[index]);
        let rows = if mean < gradient || !rules.grows_at(row.mean) {
            vec![(*row, moments, Origin::Kept)]
        } else if scale <= limit {
            out.note(index, scale / limit);
            vec![(*row, moments, Origin::Kept), (*row, (zero, zero), Origin::Clone)]
        } else {
            out.note(index, scale / limit);
            let child = |child: u32| {
                let noise = [0, 1, 2].map(|axis| normal(index, child, axis));
                let row = if rules.splits_long {
                    split_long_child(rules, row, child)
                } else {
                    split_child(rules, row, noise)
                };
                (row, (zero, zero), Origin::Child(child))
            };
            vec![child(0), child(1)]
        };
        for after in rows {
            if out.survives(rules, index, &after.0, extent, step) {
                out.push(before, index, after);
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

/// Length of the sum over tiles of the absolute 2-D gradients of each splat, NDC units.
pub fn absolute_gradient2d(
    rules: &Rules,
    splats: &[Splat],
    (size, tile): ((usize, usize), (usize, usize)),
    background: [f64; 3],
    v_image: &[[f64; 3]],
) -> Vec<f64> {
    let mut sums = vec![[0.0; 2]; splats.len()];
    for corner in (0..size.1).step_by(tile.1).flat_map(|y| (0..size.0).step_by(tile.0).map(move |x| (x, y))) {
        // The gradient is linear in the image gradient, which is zero outside of the tile.
        let inside = |index: usize| {
            let (x, y) = (index % size.0, index / size.0);
            (corner.0..corner.0 + tile.0).contains(&x) && (corner.1..corner.1 + tile.1).contains(&y)
        };
        let of_tile: Vec<[f64; 3]> =
            v_image.iter().enumerate().map(|(index, &v)| if inside(index) { v } else { [0.0; 3] }).collect();
        let found = blend_backward(rules, splats, size, background, &Upstream::from_colours(&of_tile));
        for (sum, v) in sums.iter_mut().zip(&found.values) {
            (0..2).for_each(|axis| sum[axis] += v.mean2d[axis].abs());
        }
    }
    let length = |sum: &[f64; 2]| (sum[0] * 0.5 * size.0 as f64).hypot(sum[1] * 0.5 * size.1 as f64);
    sums.iter().map(length).collect()
}

/// Adds a view to the statistic: gradient norm and one view per visible Gaussian. Skips dropped gradients.
pub fn accumulate(population: &mut Population, gradient2d: &[f64], visible: &[bool]) {
    let counts = |index: &usize| visible[*index] && gradient2d[*index] < wide(GRADIENT_MAX);
    for index in (0..visible.len()).filter(counts) {
        population.gradient_sum[index] += gradient2d[index];
        population.gradient_count[index] += 1.0;
    }
}

impl DensifiedPopulation {
    pub(super) fn push(&mut self, before: &Population, index: usize, (row, (m, u), origin): (Row, (Row, Row), Origin)) {
        self.model.rows.push(row);
        self.model.labels.push(before.model.labels[index]);
        self.m.push(m);
        self.u.push(u);
        self.origins.push((index, origin));
    }

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
