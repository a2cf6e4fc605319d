//! Schedules and checks of the training configuration.

use labelgs::run::TrainConfig;
use labelgs::scenes::ReadOptions;
use labelgs::train::strategy::adc::resets_opacity_at;

#[test]
fn schedules_follow_the_reference() {
    let config = TrainConfig::adc();
    let position = |step| config.rates_at(step).position;
    assert!((position(0) - 1.6e-4).abs() < 1e-12);
    assert!((position(15_000) - 1.6e-5).abs() < 1e-12);
    assert!((position(90_000) - 1.6e-6).abs() < 1e-12);
    assert_eq!([999, 1000, 2000, 3000, 9000].map(|step| config.sh_degree_at(step)), [0, 1, 2, 3, 3]);
    let densifies: Vec<u32> = (1..=800).filter(|&step| config.densifies_at(step)).collect();
    assert_eq!(densifies, [600, 700, 800]);
    let resets =
        |config: &TrainConfig| (1..=15_000).filter(|&step| resets_opacity_at(config, step)).collect::<Vec<_>>();
    assert!(resets(&config).is_empty());
    assert_eq!(resets(&TrainConfig { opacity_reset_interval: 3000, ..config.clone() }), [3000, 6000]);
    assert_eq!(resets(&TrainConfig::paper()), [3000, 6000, 9000, 12_000]);
    assert!(!config.labels_at(999) && config.labels_at(1000));
    assert!((config.rates_at(7000).colour_rest - 1.25e-4).abs() < 1e-15);
}

#[test]
fn densification_of_3dgs_ends_at_half_of_the_run() {
    let last = |iterations| {
        let config = TrainConfig { iterations, ..TrainConfig::adc() };
        (1..=iterations).filter(|&step| config.densifies_at(step)).max()
    };
    assert_eq!([400, 1500, 3000, 30_000].map(last), [None, Some(1400), Some(1400), Some(14_900)]);
}

/// Schedules without a given step are fractions of the run, and the rates fit its length.
#[test]
fn schedules_are_fractions_of_the_run() {
    let of = |iterations| TrainConfig { iterations, ..TrainConfig::default() };
    let (short, long) = (of(1000), of(30_000));
    assert_eq!([short.densify_from(), short.densify_until(), short.full_size_from()], [50, 500, 600]);
    assert_eq!([long.densify_from(), long.densify_until(), long.labels_from()], [500, 15_000, 18_000]);
    assert_eq!([99, 100, 300, 999].map(|step| short.sh_degree_at(step)), [0, 1, 3, 3]);
    let scale = |config: &TrainConfig, step| config.rates_at(step).scale / 0.005;
    assert!((scale(&short, 1) - 30.0_f64.powf(0.3)).abs() < 1e-9 && (scale(&long, 1) - 1.0).abs() < 1e-9);
    assert!((scale(&long, 30_000) - 0.1).abs() < 1e-9 && (scale(&of(10), 1) - 3.0).abs() < 1e-12);
    // Photos that so many Gaussians as 30 a step cannot resolve stay small for longer.
    let large = short.for_size((1000, 600));
    assert_eq!((large.budget, large.start_size, large.full_size_from()), (30_000, Some(0.16), 805));
    let small = short.for_size((200, 100));
    assert_eq!((small.budget, small.start_size, small.full_size_from()), (10_000, Some(0.4), 600));
    assert_eq!(TrainConfig { start_size: Some(1.0), ..of(1000) }.for_size((1000, 600)).full_size_from(), 0);
    let bounded = TrainConfig { budget: 9000, ..short };
    assert_eq!([51, 275, 467, 900].map(|step| bounded.budget_at(step, 1000)), [1019, 5316, 9000, 9000]);
    assert_eq!(TrainConfig { label_from: Some(3), ..of(1000) }.labels_from(), 600, "small photos have no labels");
}

#[test]
fn invalid_settings_are_refused_by_name() {
    let broken = [
        (TrainConfig { iterations: 0, ..Default::default() }, "iterations"),
        (TrainConfig { label_threshold: f32::NAN, ..Default::default() }, "label_threshold"),
        (TrainConfig { label_threshold: 1.5, ..Default::default() }, "label_threshold"),
        (TrainConfig { sh_degree: 4, ..Default::default() }, "sh_degree"),
        (TrainConfig { opacity_lr: -1.0, ..Default::default() }, "opacity_lr"),
        (TrainConfig { background: [0.0, 0.0, 2.0], ..Default::default() }, "background"),
    ];
    for (config, name) in broken {
        let message = config.check().expect_err(name).to_string();
        assert!(message.starts_with(name), "{message}");
    }
    TrainConfig::default().check().expect("the defaults are sound");
    let message = ReadOptions { test_every: 1, ..Default::default() }.check().expect_err("nothing is left").to_string();
    assert!(message.starts_with("test_every"), "{message}");
}
