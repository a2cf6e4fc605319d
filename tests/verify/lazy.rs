//! Updates without gradients, all at once, against the same one by one.

use crate::reference::adam::{AdamState, Rates, adam, adam_value};
use crate::reference::lazy::{caught_up, corrected, one_by_one};
use crate::reference::model::ROW_FLOATS;
use crate::reference::{Row, Rules};
use crate::support::scenes::{generator, uniform};

const STEP_COUNT: u32 = 1000;

/// Rates that fall, each in a way of its own.
fn rates(step: u32) -> Rates {
    let late = f64::from(step) / f64::from(STEP_COUNT);
    Rates([0, 1, 2, 3, 4, 5, 6, 7].map(|k| 0.01 / f64::from(1 << k) * (0.01_f64).powf(late * f64::from(k))))
}

/// A gradient of any size, in some steps.
fn gradient(random: &mut rand_pcg::Pcg32) -> Option<Row> {
    (uniform(random, 0.0, 1.0) < 0.06).then(|| {
        let size = 10.0_f64.powf(uniform(random, -7.0, 3.0));
        Row::from_floats(&[0.0; ROW_FLOATS].map(|_| size * uniform(random, -1.0, 1.0)))
    })
}

/// Largest distance of parameters, and of moments relative to themselves.
fn distance(a: &AdamState, b: &AdamState) -> [f64; 2] {
    let most = |a: &Row, b: &Row, scale: &dyn Fn(f64) -> f64| {
        a.floats().iter().zip(b.floats()).map(|(&a, b)| (a - b).abs() / scale(b)).fold(0.0, f64::max)
    };
    let relative = |of: f64| of.abs().max(f64::MIN_POSITIVE);
    [most(&a.row, &b.row, &|_| 1.0), most(&a.m, &b.m, &relative).max(most(&a.u, &b.u, &relative))]
}

/// Gaussians that steps touch at random, up to hundreds of steps apart.
#[test]
fn late_updates_equal_those_of_every_step() {
    let rules = Rules::default();
    let mut random = generator(77);
    let mut longest = 0;
    for _ in 0..8 {
        let (mut every, mut late, mut last) = (AdamState::default(), AdamState::default(), 0);
        for step in 1..=STEP_COUNT {
            let found = gradient(&mut random).filter(|_| !(40..=400).contains(&step));
            every = adam(&rules, &rates(step), step, &every, &found.unwrap_or_default());
            if found.is_some() || step == STEP_COUNT {
                let missed: Vec<Rates> = (last + 1..step).map(|step| corrected(&rules, &rates(step), step)).collect();
                longest = longest.max(missed.len());
                late = caught_up(&rules, &missed, &late);
                late = adam(&rules, &rates(step), step, &late, &found.unwrap_or_default());
                last = step;
                let [parameters, moments] = distance(&late, &every);
                // Epsilon is 1e-15, and the smallest roots of second moments are some 1e-9: it is 1e-6 of a step of
                // 0.01.
                assert!(parameters < 1e-6 && moments < 1e-10, "step {step}: {parameters:e} {moments:e}");
            }
        }
    }
    assert!(longest > 300, "{longest} steps are the most that were missed");
    let (with, without) = (gradient_of_one(&rules, 200), gradient_of_one(&rules, 0));
    assert!((with[0] - without[0]).abs() > 0.05, "what is missed matters: {with:?} {without:?}");
}

/// A parameter after one gradient, and so many updates without.
fn gradient_of_one(rules: &Rules, more: usize) -> [f64; 3] {
    let first = adam_value(rules, 0.01, 1, [1.0, 0.0, 0.0], 0.5);
    one_by_one(rules, &vec![0.01; more], 2, first)
}

#[test]
fn without_moments_nothing_moves() {
    let rules = Rules::default();
    let state = AdamState { row: Row::from_floats(&[0.7; ROW_FLOATS]), ..AdamState::default() };
    let missed: Vec<Rates> = (1..100).map(|step| corrected(&rules, &rates(step), step)).collect();
    assert_eq!(caught_up(&rules, &missed, &state), state);
}

/// The numbers of the device: a table in f32 of sums in f64, and one subtraction for all updates.
#[test]
fn late_updates_in_f32_are_as_near_as_those_of_every_step() {
    let rules = Rules::default();
    let (beta1, beta2) = (rules.adam_beta1 as f32, rules.adam_beta2 as f32);
    let rate = |step: u32| f64::from((0.01 * 0.1_f64.powf(f64::from(step) / 1000.0)) as f32);
    let correction = |beta: f64, step: u32| (1.0 / (1.0 - beta.powf(f64::from(step)))) as f32;
    let step32 = |[value, m, u]: [f32; 3], step: u32, g: f32| {
        let (m, u) = (beta1 * m + (1.0 - beta1) * g, beta2 * u + (1.0 - beta2) * g * g);
        let (c1, c2) = (correction(rules.adam_beta1, step), correction(rules.adam_beta2, step));
        [value - rate(step) as f32 * (m * c1) / ((u * c2).sqrt() + 1e-15), m, u]
    };
    let mut random = generator(78);
    let (mut worst_late, mut worst_every) = (0.0_f64, 0.0_f64);
    for _ in 0..200 {
        let (mut exact, mut every, mut late, mut last) = ([1.0, 0.0, 0.0], [1.0_f32, 0.0, 0.0], [1.0_f32, 0.0, 0.0], 0);
        for step in 1..=STEP_COUNT {
            let found = uniform(&mut random, 0.0, 1.0) < 0.03 || step == STEP_COUNT;
            let g = if found { uniform(&mut random, -1.0, 1.0) as f32 } else { 0.0 };
            exact = adam_value(&rules, rate(step), step, exact, f64::from(g));
            every = step32(every, step, g);
            if found {
                let (mut sum, ratio) = (0.0, rules.adam_beta1 / rules.adam_beta2.sqrt());
                for past in (last + 1..step).rev() {
                    let factor = f64::from(correction(rules.adam_beta1, past));
                    let factor = factor / f64::from(correction(rules.adam_beta2, past)).sqrt();
                    sum = ratio * (f64::from((factor * rate(past)) as f32) + sum);
                }
                let (count, [value, m, u]) = ((step - last - 1) as i32, late);
                let power = |beta: f64| beta.powi(count) as f32;
                let caught = value - sum as f32 * (m / (u.sqrt() + 1e-15));
                late = step32([caught, m * power(rules.adam_beta1), u * power(rules.adam_beta2)], step, g);
                last = step;
            }
        }
        let error = |of: [f32; 3]| (f64::from(of[0]) - exact[0]).abs() / exact[0].abs().max(1.0);
        (worst_late, worst_every) = (worst_late.max(error(late)), worst_every.max(error(every)));
    }
    println!("late {worst_late:e}, every step {worst_every:e}");
    // Fewer roundings than one a step; 1.2e-7 is an ulp of 1.
    assert!(worst_late < 4e-6 && worst_late < worst_every, "late {worst_late:e}, every step {worst_every:e}");
}
