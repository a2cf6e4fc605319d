//! Packed moments: how far they are from what they stand for, once and over many updates.

use crate::reference::Rules;
use crate::reference::adam::adam_value;
use crate::reference::moments::{draw, pack, unpack};
use crate::support::scenes::{generator, uniform};

/// What rounds to the nearest.
const NEAREST: u32 = 0x7fff_7fff;
/// A step of the root of a second moment, and of the ratio.
const ROOT: f64 = 6.8e-4;
const RATIO: f64 = 1.0 / 4096.0;

#[test]
fn a_word_is_within_a_step_of_its_moments() {
    let rules = Rules::default();
    let mut random = generator(31);
    let mut mean = [0.0; 2];
    const COUNT: u32 = 20_000;
    for index in 0..COUNT {
        let v = 10.0_f64.powf(uniform(&mut random, -29.5, 8.3));
        let m = uniform(&mut random, -7.3, 7.3) * v.sqrt();
        for (draw, steps) in [(NEAREST, 0.5), (draw(5, index, 2, 1), 1.0)] {
            let (first, second) = unpack(&rules, pack(&rules, (m, v), draw));
            let (root, off) = ((second / v).sqrt() - 1.0, (first - m) / second.sqrt());
            assert!(root.abs() <= 1.001 * steps * ROOT && off.abs() <= 1.001 * steps * RATIO, "{m} {v}: {root} {off}");
            mean[0] += if steps == 1.0 { root / ROOT } else { 0.0 };
            mean[1] += if steps == 1.0 { off / RATIO } else { 0.0 };
        }
    }
    // The deviation of a draw is 0.41 of a step, that of their mean 0.003.
    assert!(mean.iter().all(|sum| (sum / f64::from(COUNT)).abs() < 0.01), "{mean:?}");
    // No moments, and those beyond the ends.
    assert_eq!((pack(&rules, (0.0, 0.0), 7), unpack(&rules, 0)), (0, (0.0, 0.0)));
    assert_eq!(pack(&rules, (0.0, 1e-34), NEAREST), 1);
    assert!((unpack(&rules, pack(&rules, (1e12, 1e24), NEAREST)).1.log2() / 2.0 - 14.0).abs() < 2e-3);
    // Fresh moments have a ratio of 3.16, those of gradients that grow have more, and none has more than 7.3.
    let (mut state, mut most) = ([0.0; 3], 0.0_f64);
    for step in 1..=200 {
        state = adam_value(&rules, 0.0, step, state, (0.9_f64 / 0.999).powi(-(step as i32)));
        most = most.max(state[1] / state[2].sqrt());
    }
    assert!((7.2..7.3).contains(&most), "{most}");
}

/// Parameters whose gradients are noise of any size about a mean: after 10,000 updates moments are those without words.
#[test]
fn moments_are_right_in_the_mean_of_many_updates() {
    const PARAMETERS: u32 = 200;
    const UPDATES: u32 = 10_000;
    let rules = Rules::default();
    let mut random = generator(32);
    let (mut sums, mut most) = ([0.0; 2], [0.0_f64; 2]);
    for index in 0..PARAMETERS {
        let (size, lean) = (10.0_f64.powf(uniform(&mut random, -10.0, 1.0)), uniform(&mut random, -0.5, 0.5));
        let (mut exact, mut word) = ([0.0; 3], 0);
        for step in 1..=UPDATES {
            // A quarter of the views show it.
            let seen = uniform(&mut random, 0.0, 1.0) < 0.25;
            let g = if seen { size * (lean + uniform(&mut random, -1.0, 1.0)) } else { 0.0 };
            exact = adam_value(&rules, 0.0, step, exact, g);
            let (m, v) = unpack(&rules, word);
            let [_, m, v] = adam_value(&rules, 0.0, step, [0.0, m, v], g);
            word = pack(&rules, (m, v), draw(step, index, 0, 0));
        }
        let (m, v) = unpack(&rules, word);
        let off = [v / exact[2] - 1.0, (m - exact[1]) / exact[2].sqrt()];
        (0..2).for_each(|k| (sums[k], most[k]) = (sums[k] + off[k], most[k].max(off[k].abs())));
    }
    let mean = sums.map(|sum| sum / f64::from(PARAMETERS));
    println!("off in the mean by {mean:?}, at most by {most:?}");
    // A draw moves v by up to 1.36e-3, with a deviation of 5.5e-4; a thousand of them count: 0.0123 for one parameter,
    // 8.7e-4 for the mean of all. Of the ratio about five count, each with 1e-4: 2.3e-4 and 1.6e-5, and m follows
    // what v is off by.
    assert!(mean[0].abs() < 3e-3 && mean[1].abs() < 1e-4, "{mean:?}");
    assert!(most[0] < 0.05 && most[1] < 2e-3, "{most:?}");
}

/// Why they are rounded at random: to the nearest, v stays where it was, though its mean is a third more.
#[test]
fn to_the_nearest_step_second_moments_stand_still() {
    let rules = Rules::default();
    let after = |random: bool| {
        let mut word = pack(&rules, (0.0, 1e-8), NEAREST);
        for step in 1..=10_000 {
            let (m, v) = unpack(&rules, word);
            let [_, m, v] = adam_value(&rules, 0.0, step, [0.0, m, v], 1.15e-4);
            word = pack(&rules, (m, v), if random { draw(step, 0, 0, 0) } else { NEAREST });
        }
        unpack(&rules, word).1 / 1e-8
    };
    let (nearest, random) = (after(false), after(true));
    assert!((nearest - 1.0).abs() < 2e-3 && (random / 1.3225 - 1.0).abs() < 0.05, "{nearest} {random}");
}
