//! Schedules and checks of the training configuration.

use labelgs::internals::train::strategy::default::{densifies_at, resets_opacity_at};
use labelgs::io::ReadOptions;
use labelgs::run::TrainConfig;

#[test]
fn schedules_follow_the_reference() {
    let config = TrainConfig::default();
    assert!((config.position_lr(0) - 1.6e-4).abs() < 1e-12);
    assert!((config.position_lr(15_000) - 1.6e-5).abs() < 1e-12);
    assert!((config.position_lr(90_000) - 1.6e-6).abs() < 1e-12);
    assert_eq!([999, 1000, 2000, 3000, 9000].map(|step| config.sh_degree_at(step)), [0, 1, 2, 3, 3]);
    let densifies: Vec<u32> = (1..=800).filter(|&step| densifies_at(&config, step)).collect();
    assert_eq!(densifies, [600, 700, 800]);
    let resets =
        |config: &TrainConfig| (1..=15_000).filter(|&step| resets_opacity_at(config, step)).collect::<Vec<_>>();
    assert!(resets(&config).is_empty());
    assert_eq!(resets(&TrainConfig { opacity_reset_interval: 3000, ..config.clone() }), [3000, 6000]);
    assert_eq!(resets(&TrainConfig::paper()), [3000, 6000, 9000, 12_000]);
    assert!(!config.labels_at(999) && config.labels_at(1000));
    assert!((config.feature_rest_lr() - 1.25e-4).abs() < 1e-15);
}

#[test]
fn densification_ends_at_half_of_the_run() {
    let last = |iterations| {
        let config = TrainConfig { iterations, ..TrainConfig::default() };
        (1..=iterations).filter(|&step| densifies_at(&config, step)).max()
    };
    assert_eq!([400, 1500, 3000, 30_000].map(last), [None, Some(1400), Some(1400), Some(14_900)]);
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
