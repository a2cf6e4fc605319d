//! Updates of Adam without gradients, all at once.

use super::adam::{AdamState, Rates, adam_value};
use super::{Group, Row, Rules};

/// Returns the learning rates of an update with bias correction; `step` counts from 1.
pub fn corrected(rules: &Rules, rates: &Rates, step: u32) -> Rates {
    let correction = |beta: f64| 1.0 - beta.powf(f64::from(step));
    let factor = correction(rules.adam_beta2).sqrt() / correction(rules.adam_beta1);
    Rates(rates.0.map(|rate| factor * rate))
}

/// Returns a Gaussian after updates with these corrected rates and zero gradients. Epsilon is ignored except for zero
/// moments.
///
/// The k-th of them moves a parameter by its rate times (beta1 / sqrt(beta2))^k m / sqrt(u), with the initial moments.
pub fn caught_up(rules: &Rules, missed: &[Rates], state: &AdamState) -> AdamState {
    let ratio = rules.adam_beta1 / rules.adam_beta2.sqrt();
    let mut sums = [0.0; 8];
    for (k, rates) in (1..).zip(missed) {
        sums.iter_mut().zip(rates.0).for_each(|(sum, rate)| *sum += ratio.powi(k) * rate);
    }
    let (mut row, mut m, mut u) = (state.row.floats(), state.m.floats(), state.u.floats());
    let count = missed.len() as i32;
    for (group, sum) in Group::ALL.into_iter().zip(sums) {
        for i in group.range() {
            row[i] -= sum * m[i] / (u[i].sqrt() + rules.adam_eps);
            m[i] *= rules.adam_beta1.powi(count);
            u[i] *= rules.adam_beta2.powi(count);
        }
    }
    AdamState { row: Row::from_floats(&row), m: Row::from_floats(&m), u: Row::from_floats(&u) }
}

/// Same as [`caught_up`] for one parameter, update by update, with epsilon in each; `first` is the number of the first
/// update.
pub fn one_by_one(rules: &Rules, rates: &[f64], first: u32, value: [f64; 3]) -> [f64; 3] {
    (first..).zip(rates).fold(value, |value, (step, &rate)| adam_value(rules, rate, step, value, 0.0))
}
