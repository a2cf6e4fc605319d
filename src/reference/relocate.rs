//! 3DGS-MCMC: draws by opacity, stacks of copies, random moves, and the terms of opacity and size in the loss.

use super::densify::{DensifiedPopulation, Origin, Population};
use super::project::{normalised, rotation, sigmoid};
use super::{Row, Rules};
use glam::DVec3;

/// Weight of each row in the draw, in whole steps, and the distance of its nearest decision. Dead rows have 0.
pub fn weights(rules: &Rules, before: &Population) -> Vec<(u32, f64)> {
    let weight = |(index, (row, &views)): (usize, (&Row, &f64))| {
        if before.is_frozen(index) {
            return (1, f64::INFINITY);
        }
        let opacity = sigmoid(row.opacity);
        let steps = if rules.grows_at(row.mean) { opacity * rules.relocate_one + 0.5 } else { 1.25 };
        let margin = (opacity / rules.prune_opacity - 1.0).abs().min((steps - steps.round()).abs() / steps);
        let dead = opacity < rules.prune_opacity || views >= rules.stat_near;
        (if dead { 0 } else { (steps.floor() as u32).max(1) }, margin)
    };
    before.model.rows.iter().zip(&before.gradient_count).enumerate().map(weight).collect()
}

/// Number of copies of each row, itself included, after `draws` draws from a start `phase` in 0 to 1, and the distance
/// of its nearest decision.
pub fn copies(rules: &Rules, weights: &[u32], draws: u32, phase: f64) -> Vec<(u32, f64)> {
    let total: f64 = weights.iter().copied().map(f64::from).sum();
    let mut before = 0.0;
    let mut place = |weight: u32| {
        before += f64::from(weight);
        before / total * f64::from(draws) + phase
    };
    let mut from = place(0);
    let count = |&weight: &u32| {
        let to = place(weight);
        let whole = |at: f64| (at.floor() as u32).min(draws);
        let drawn = whole(to) - whole(from);
        let margin = [from, to].map(|at| (at - at.round()).abs() / at.max(1.0));
        from = to;
        (if weight == 0 { 0 } else { 1 + drawn.min(rules.relocate_most - 1) }, margin[0].min(margin[1]))
    };
    weights.iter().map(count).collect()
}

/// One of `count` equal rows at one place that together look like `row`.
pub fn stacked(rules: &Rules, row: &Row, count: u32) -> Row {
    let whole = sigmoid(row.opacity);
    let part = (1.0 - (1.0 - whole).powf(1.0 / f64::from(count))).max(rules.prune_opacity);
    let light: f64 = (1..=count).map(|j| (1.0 - (1.0 - part).powi(j as i32)) / f64::from(j)).sum();
    let scale = row.scale.map(|s| s + 0.5 * (whole / light).ln());
    Row { opacity: (part / (1.0 - part)).ln(), scale, ..*row }
}

/// Removes dead rows, and stacks `draws` copies on the others.
pub fn relocate(rules: &Rules, before: &Population, draws: u32, phase: f64) -> DensifiedPopulation {
    let weights = weights(rules, before);
    let counts = copies(rules, &weights.iter().map(|&(weight, _)| weight).collect::<Vec<_>>(), draws, phase);
    let count_of = |(index, (row, (count, margin))): (usize, (&Row, (u32, f64)))| {
        // Draws outside of the growth box are ignored.
        let grows = rules.grows_at(row.mean) && !before.is_frozen(index);
        (if grows { count } else { count.min(1) }, margin)
    };
    let counts: Vec<(u32, f64)> = before.model.rows.iter().zip(counts).enumerate().map(count_of).collect();
    let margin = |(weight, count): (&(u32, f64), &(u32, f64))| weight.1.min(count.1);
    let mut out = DensifiedPopulation {
        margins: weights.iter().zip(&counts).map(margin).collect(),
        ..DensifiedPopulation::default()
    };
    out.model.sh_degree = before.model.sh_degree;
    for (index, row) in before.model.rows.iter().enumerate() {
        let count = counts[index].0;
        let (zero, moments) = (Row::default(), (before.m[index], before.u[index]));
        let (stacked, moments) = if count == 1 { (*row, moments) } else { (stacked(rules, row, count), (zero, zero)) };
        for copy in 0..count {
            out.push(before, index, (stacked, moments, if copy == 0 { Origin::Kept } else { Origin::Clone }));
        }
    }
    out
}

/// Random move of a row by three standard normal numbers.
pub fn explored(rules: &Rules, row: &Row, noise: f64, draw: [f64; 3]) -> Row {
    let axes = rotation(normalised(row.quat).0);
    let along = axes.transpose() * DVec3::from(draw);
    let variances = DVec3::from(row.scale.map(|s| (2.0 * s).exp()));
    let gate = sigmoid(-rules.noise_steep * (sigmoid(row.opacity) - rules.noise_opacity));
    Row { mean: (DVec3::from(row.mean) + noise * gate * (axes * (variances * along))).into(), ..*row }
}

/// Terms of a row in the loss, with the weights of its opacity and of its standard deviations; and their gradient.
pub fn regularised(row: &Row, [opacity_weight, scale_weight]: [f64; 2]) -> (f64, Row) {
    let (opacity, sizes) = (sigmoid(row.opacity), row.scale.map(f64::exp));
    let value = opacity_weight * opacity + scale_weight * sizes.iter().sum::<f64>();
    let scale = sizes.map(|size| scale_weight * size);
    (value, Row { opacity: opacity_weight * opacity * (1.0 - opacity), scale, ..Row::default() })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The light that coincident rows absorb: the integral of 1 - (1 - alpha)^count over the picture.
    fn light(row: &Row, count: i32) -> f64 {
        let (deviation, opacity) = (row.scale[0].exp(), sigmoid(row.opacity));
        let step = 1e-3;
        let ring = |k: usize| {
            let radius = (k as f64 + 0.5) * step;
            (1.0 - (1.0 - opacity * (-0.5 * radius * radius).exp()).powi(count)) * radius * step
        };
        deviation * deviation * (0..10_000).map(ring).sum::<f64>()
    }

    #[test]
    fn a_stack_has_the_opacity_and_the_light_of_the_one() {
        let rules = Rules { prune_opacity: 0.0, ..Rules::default() };
        for (opacity, count) in [(-3.0, 2), (0.5, 2), (4.0, 7), (7.0, 51)] {
            let row = Row { opacity, ..Row::default() };
            let part = stacked(&rules, &row, count);
            let whole = 1.0 - (1.0 - sigmoid(part.opacity)).powi(count as i32);
            assert!((whole / sigmoid(opacity) - 1.0).abs() < 1e-9);
            assert!((light(&part, count as i32) / light(&row, 1) - 1.0).abs() < 1e-6, "{opacity} {count}");
        }
    }

    #[test]
    fn draws_are_in_proportion_to_weights() {
        let weights = [10, 0, 30, 1, 59];
        let counts = copies(&Rules::default(), &weights, 50, 0.25);
        assert_eq!(counts.iter().map(|count| count.0).collect::<Vec<_>>(), [6, 0, 16, 1, 31]);
    }
}
