//! Predicates of the tests.

pub use labelgs::verify::selftest::compare::*;

/// Panics with the verdict's text.
#[track_caller]
pub fn check(name: &str, verdict: Verdict) -> Summary {
    match verdict {
        Ok(summary) => summary,
        Err(text) => panic!("{name}: {text}"),
    }
}
