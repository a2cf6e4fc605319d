//! The optimiser.

use super::{Group, Row, Rules};

/// Learning rate of each group, in the order of `Group::ALL`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rates(pub [f64; 8]);

/// Parameters with their moments.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Optimised {
    /// Parameters.
    pub row: Row,
    /// First moments.
    pub m: Row,
    /// Second moments.
    pub u: Row,
}

/// One update of one Gaussian; `step` counts from 1 and corrects the bias of young moments.
pub fn adam(rules: &Rules, rates: &Rates, step: u32, state: &Optimised, gradient: &Row) -> Optimised {
    let (mut row, mut m, mut u) = (state.row.floats(), state.m.floats(), state.u.floats());
    let g = gradient.floats();
    let (beta1, beta2) = (rules.adam_beta1, rules.adam_beta2);
    let exponent = f64::from(step);
    let (correct1, correct2) = (1.0 - beta1.powf(exponent), 1.0 - beta2.powf(exponent));
    for (group, rate) in Group::ALL.into_iter().zip(rates.0) {
        for i in group.range() {
            m[i] = beta1 * m[i] + (1.0 - beta1) * g[i];
            u[i] = beta2 * u[i] + (1.0 - beta2) * g[i] * g[i];
            row[i] -= rate * (m[i] / correct1) / ((u[i] / correct2).sqrt() + rules.adam_eps);
        }
    }
    Optimised { row: Row::from_floats(&row), m: Row::from_floats(&m), u: Row::from_floats(&u) }
}

/// Rate that falls from `first` to `last` along an exponential over `steps`.
pub fn falling_rate(first: f64, last: f64, steps: u32, step: u32) -> f64 {
    let t = (f64::from(step) / f64::from(steps)).clamp(0.0, 1.0);
    ((1.0 - t) * first.ln() + t * last.ln()).exp()
}
