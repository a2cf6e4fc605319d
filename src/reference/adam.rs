//! The optimiser.

use super::{Group, Row, Rules};

/// Learning rate of each group, in the order of `Group::ALL`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rates(pub [f64; 8]);

/// Parameters with their moments.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AdamState {
    /// Parameters.
    pub row: Row,
    /// First moments.
    pub m: Row,
    /// Second moments.
    pub u: Row,
}

/// One update of one Gaussian; `step` counts from 1 and corrects the bias of the moments.
pub fn adam(rules: &Rules, rates: &Rates, step: u32, state: &AdamState, gradient: &Row) -> AdamState {
    let (mut row, mut m, mut u) = (state.row.floats(), state.m.floats(), state.u.floats());
    let g = gradient.floats();
    for (group, rate) in Group::ALL.into_iter().zip(rates.0) {
        for i in group.range() {
            [row[i], m[i], u[i]] = adam_value(rules, rate, step, [row[i], m[i], u[i]], g[i]);
        }
    }
    AdamState { row: Row::from_floats(&row), m: Row::from_floats(&m), u: Row::from_floats(&u) }
}

/// One update of one parameter with its moments; `step` counts from 1.
pub fn adam_value(rules: &Rules, rate: f64, step: u32, [value, m, u]: [f64; 3], g: f64) -> [f64; 3] {
    let (beta1, beta2, exponent) = (rules.adam_beta1, rules.adam_beta2, f64::from(step));
    let m = beta1 * m + (1.0 - beta1) * g;
    let u = beta2 * u + (1.0 - beta2) * g * g;
    let (m_hat, u_hat) = (m / (1.0 - beta1.powf(exponent)), u / (1.0 - beta2.powf(exponent)));
    [value - rate * m_hat / (u_hat.sqrt() + rules.adam_eps), m, u]
}
