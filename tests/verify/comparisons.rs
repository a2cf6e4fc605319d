//! Each predicate of `support::compare` fails for each of its reasons.

use crate::support::compare::{Band, GradientBounds, Tolerance, Verdict, close, close_with_band, exact, gradients};

const TIGHT: Tolerance = Tolerance { absolute: 1e-3, relative: 1e-3 };
const BAND: Band = Band { width: 0.1, flip: 0.5, ratio: 0.2 };
const BOUNDS: GradientBounds = GradientBounds {
    element: Tolerance { absolute: 1e-2, relative: 1e-2 },
    outliers: 0.02,
    norm: 1e-2,
    angle: 1e-3,
    bias: 1e-3,
};

#[track_caller]
fn fails(verdict: Verdict, because: &str) {
    let text = verdict.expect_err("the comparison must fail");
    assert!(text.contains(because), "fails for another reason: {text}");
}

#[test]
fn exact_sees_values_and_lengths() {
    assert!(exact(&[1, 2], &[1, 2]).is_ok());
    fails(exact(&[1, 2], &[1, 3]), "1 of 2 elements differ, first at 1: 2, expected 3");
    fails(exact(&[1, 2], &[1]), "2 elements, expected 1");
}

#[test]
fn close_bounds_each_element() {
    assert!(close(&[100.0, 0.0], &[100.09, 0.0009], TIGHT).is_ok());
    fails(close(&[100.0], &[100.2], TIGHT), "element 0");
    fails(close(&[0.0, 0.0], &[0.0, 0.0011], TIGHT), "element 1");
    fails(close(&[0.0], &[], TIGHT), "1 elements, expected 0");
}

#[test]
fn close_refuses_what_is_not_a_number() {
    fails(close(&[f64::NAN], &[0.0], TIGHT), "NaN");
    fails(close(&[0.0], &[f64::NAN], TIGHT), "NaN");
    fails(close(&[f64::INFINITY], &[0.0], TIGHT), "inf");
    assert!(close(&[f64::INFINITY], &[f64::INFINITY], TIGHT).is_ok());
}

#[test]
fn close_with_no_tolerance_takes_only_equals() {
    let none = Tolerance { absolute: 0.0, relative: 0.0 };
    assert!(close(&[0.0, 2.0], &[0.0, 2.0], none).is_ok());
    fails(close(&[1e-300], &[0.0], none), "element 0");
}

/// Ten elements, the first `near` of them in the band; `change` is added to the first two.
fn banded(near: usize, change: f64, proof: bool) -> Verdict {
    let expected = [1.0; 10];
    let actual: Vec<f64> = (0..10).map(|i| if i < 2 { 1.0 + change } else { 1.0 }).collect();
    let margins: Vec<f64> = (0..10).map(|i| if i < near { 0.01 } else { 1.0 }).collect();
    close_with_band(&actual, &expected, &margins, (TIGHT, BAND), |_, _| proof)
}

#[test]
fn band_is_tight_outside() {
    assert_eq!(banded(2, 0.3, true).expect("two flips of ten are allowed").flips, 2);
    fails(banded(1, 0.3, true), "outside the band");
    fails(banded(0, 0.3, true), "outside the band");
}

#[test]
fn band_bounds_the_size_of_a_flip_and_wants_proof() {
    fails(banded(2, 0.6, true), "more than a flip");
    fails(banded(2, 0.3, false), "no crossing");
    fails(banded(2, f64::NAN, true), "more than a flip");
}

#[test]
fn band_caps_the_number_of_flips() {
    let (actual, margins) = ([1.3, 0.7, 1.3, 1.0], [0.0; 4]);
    fails(close_with_band(&actual, &[1.0; 4], &margins, (TIGHT, BAND), |_, _| true), "3 flips among 4 elements; 1 are");
}

#[test]
fn band_wants_flips_both_ways() {
    let run = |up: usize| {
        let actual: Vec<f64> = (0..100)
            .map(|i| {
                if i < up {
                    1.2
                } else if i < 20 {
                    0.8
                } else {
                    1.0
                }
            })
            .collect();
        close_with_band(&actual, &[1.0; 100], &[0.0; 100], (TIGHT, BAND), |_, _| true)
    };
    assert!(run(10).is_ok());
    assert!(run(15).is_ok());
    fails(run(18), "a bias");
    fails(run(1), "a bias");
}

#[test]
fn band_checks_lengths() {
    fails(close_with_band(&[1.0], &[1.0], &[], (TIGHT, BAND), |_, _| true), "0 elements, expected 1");
}

/// Expected values of both signs over some decades.
fn slopes() -> Vec<f64> {
    (0..200).map(|i| (f64::from(i) * 0.7).sin() * f64::from(i % 7 + 1)).collect()
}

fn changed(change: impl Fn(usize, f64) -> f64) -> Verdict {
    let expected = slopes();
    let actual: Vec<f64> = expected.iter().enumerate().map(|(i, &e)| change(i, e)).collect();
    gradients(&actual, &expected, BOUNDS)
}

#[test]
fn gradients_pass_with_small_unbiased_errors() {
    assert!(changed(|_, e| e).is_ok());
    let summary = changed(|i, e| if i % 2 == 0 { e * 1.001 } else { e * 0.999 }).expect("small errors pass");
    assert!(summary.worst > 0.01 && summary.flips == 0);
}

#[test]
fn gradients_cap_outliers() {
    assert_eq!(changed(|i, e| if i == 3 { e + 0.12 } else { e }).expect("1 of 200 may stand out").flips, 1);
    fails(changed(|i, e| if i % 10 == 3 { e + 0.2 } else { e }), "20 of 200 elements beyond the bound");
}

#[test]
fn gradients_see_one_great_error_in_the_norm() {
    fails(changed(|i, e| if i == 3 { e + 2.0 } else { e }), "norm");
}

#[test]
fn gradients_see_a_turn() {
    let loose = GradientBounds { norm: 1.0, bias: 1.0, outliers: 1.0, ..BOUNDS };
    let expected = slopes();
    let actual: Vec<f64> = expected.iter().rev().map(|e| e * 0.3).zip(&expected).map(|(t, e)| e + t).collect();
    fails(gradients(&actual, &expected, loose), "angle");
}

#[test]
fn gradients_see_a_small_common_factor() {
    fails(changed(|_, e| e * 1.005), "bias");
}

#[test]
fn gradients_refuse_nan_and_need_zero_where_all_is_zero() {
    fails(changed(|i, e| if i == 7 { f64::NAN } else { e }), "element 7 is NaN");
    assert!(gradients(&[0.0; 3], &[0.0; 3], BOUNDS).is_ok());
    fails(gradients(&[0.0, 1e-9, 0.0], &[0.0; 3], BOUNDS), "element 1");
    fails(gradients(&[0.0], &[0.0; 3], BOUNDS), "1 elements, expected 3");
}
