//! Checks a state before it is saved as a checkpoint.

/// Returns the first row, of `words` values, with an infinity or NaN; `None` if all are finite.
pub fn first_nonfinite(values: &[f64], words: usize) -> Option<usize> {
    values.iter().position(|value| !value.is_finite()).map(|at| at / words.max(1))
}
