//! The Gaussians that a training starts with.

use labelgs::run::{StrategyKind, TrainConfig};
use labelgs::scene::{Dataset, Gaussians, Point};
use labelgs::scenes::initial_gaussians;
use labelgs::train::first_model;

#[path = "../../src/scenes/tests/rigs.rs"]
mod rigs;

use rigs::{dataset, point, ring};

/// Growth chooses the places of most Gaussians; relocation starts with small opaque ones.
#[test]
fn a_training_starts_with_a_part_of_its_budget() {
    let scene = dataset(ring(12), |_, _| [90, 60, 30]);
    let of = |strategy, max_gaussians| {
        let config = TrainConfig { strategy, budget: 4000, max_gaussians, far_points: 0, ..TrainConfig::default() };
        first_model(&scene, &config).expect("Gaussians")
    };
    let (grown, drawn) = (of(StrategyKind::Budget, 0), of(StrategyKind::Mcmc, 0));
    assert_eq!((grown.len(), drawn.len()), (1000, 1000));
    assert_eq!(drawn.means, grown.means);
    assert!(drawn.scales[0][0] < grown.scales[0][0] && drawn.opacities[0] > grown.opacities[0]);
    assert_eq!(of(StrategyKind::Adc, 0).len(), 50_000);
    assert_eq!(of(StrategyKind::Budget, 300).len(), 300);
}

/// A laser scan has more points than the photos have pixels. They are thinned over all of their place, and the
/// Gaussians get the sizes of what is left, with room for growth below a limit; one that allows all of them keeps them
/// all.
#[test]
fn points_far_beyond_the_budget_are_thinned_evenly() {
    let mut scene = dataset(ring(6), |_, _| [90, 60, 30]);
    let wall = |side: usize| {
        let place = move |at: usize| (at as f64 + 0.5) / side as f64 * 2.0 - 1.0;
        (0..side * side).map(move |at| point(1.0, place(at % side), place(at / side))).collect::<Vec<Point>>()
    };
    let of = |scene: &Dataset, config: TrainConfig| {
        first_model(scene, &TrainConfig { far_points: 0, ..config }).expect("Gaussians")
    };
    let config = || TrainConfig::default();
    // The photos ask for 64 x 48 / 2 Gaussians.
    scene.points = wall(70);
    assert_eq!(of(&scene, config()), initial_gaussians(&scene, 0, 10).expect("Gaussians"), "not far beyond it");
    scene.points = wall(150);
    let all = initial_gaussians(&scene, 0, 10).expect("Gaussians");
    assert_eq!(of(&scene, TrainConfig { max_gaussians: 22_500, ..config() }), all);
    assert_eq!(of(&scene, TrainConfig { strategy: StrategyKind::Adc, ..config() }), all);
    for (config, count) in [
        (config(), 6144),
        (TrainConfig { iterations: 1, ..config() }, 6144),
        (TrainConfig { budget: 700, ..config() }, 2800),
        (TrainConfig { max_gaussians: 3000, ..config() }, 3000),
        (TrainConfig { max_gaussians: 1200, ..config() }, 600),
        (TrainConfig { max_gaussians: 3000, strategy: StrategyKind::Adc, ..config() }, 1500),
    ] {
        let thin = of(&scene, config);
        assert_eq!(thin.len(), count);
        for quarter in 0..16 {
            let at = |row: usize| {
                let place = thin.world(row);
                let quarter = |value: f64| ((value + 1.0) * 2.0) as usize;
                quarter(place.y) + 4 * quarter(place.z)
            };
            let inside = (0..count).filter(|&row| at(row) == quarter).count();
            assert!(inside.abs_diff(count / 16) < count / 64, "{inside} of {count} in a sixteenth");
        }
        let mean =
            |model: &Gaussians| model.scales.iter().map(|scale| f64::from(scale[0])).sum::<f64>() / model.len() as f64;
        let grown = (mean(&thin) - mean(&all)).exp() / (22_500.0 / count as f64).sqrt();
        assert!((0.75..1.3).contains(&grown), "{grown}");
    }
    let with_far = TrainConfig { max_gaussians: 3000, ..config() };
    assert!((2200..=3000).contains(&first_model(&scene, &with_far).expect("Gaussians").len()));
}
