//! Free space without Gaussians: in front of the training cameras, and in front of cameras between two of them.
//!
//! Gaussians there represent nothing in the photos. If no training camera sees them, training cannot remove them, but
//! they fog views between the cameras.

use super::sampler::stream;
use crate::scene::{Camera, Dataset, Gaussians};
use crate::scenes::init;
use crate::train::setup::near_plane::{sample, seen_depths};
use glam::DVec3;
use rand::Rng;

/// Most Gaussians to take depths from, evenly sampled.
const SAMPLE_GAUSSIANS_MAX: usize = 65_536;
/// Near plane of a camera, as a share of a quantile of the visible Gaussians' depths.
const NEAR_SHARE: f64 = 0.25;
/// That quantile.
const NEAR_QUANTILE: f64 = 0.01;
/// The quantile for scenes without points, where some initial Gaussians are in front of everything.
const NEAR_QUANTILE_RANDOM: f64 = 0.1;
/// Number of nearest cameras, including itself, over which a camera takes the median.
const MEDIAN_CAMERAS: usize = 5;

/// Returns the near plane of each camera, at least `least`. Space up to there is assumed to be free: nothing is that
/// much nearer than everything the camera sees of the initial `model`.
pub(in crate::train) fn view_planes(dataset: &Dataset, model: &Gaussians, least: f32) -> Vec<f32> {
    let cameras = dataset.train.iter().map(|view| &view.camera);
    let quantile = if init::has_points(dataset) { NEAR_QUANTILE } else { NEAR_QUANTILE_RANDOM };
    let rows = sample(model, SAMPLE_GAUSSIANS_MAX);
    let nearest = |camera: &Camera| {
        let mut depths = seen_depths(camera, &rows);
        let at = (quantile * depths.len() as f64) as usize;
        (!depths.is_empty()).then(|| *depths.select_nth_unstable_by(at, f64::total_cmp).1)
    };
    let found: Vec<(DVec3, f64)> = cameras.map(|camera| (camera.centre(), nearest(camera).unwrap_or(0.0))).collect();
    let plane = |centre: DVec3| {
        let mut near: Vec<(f64, f64)> = found.iter().map(|&(other, depth)| (other.distance(centre), depth)).collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut depths: Vec<f64> = near.iter().take(MEDIAN_CAMERAS).map(|&(_, depth)| depth).collect();
        depths.sort_by(f64::total_cmp);
        least.max((NEAR_SHARE * depths[depths.len() / 2]) as f32)
    };
    found.iter().map(|&(centre, _)| plane(centre)).collect()
}

/// Most partner cameras per camera.
const PARTNERS_MAX: usize = 4;
/// Smallest cosine of the angle between partners' directions.
const AXES_COSINE_MIN: f64 = 0.85;
/// Random stream for a step's partner, distinct from the step numbers.
const PARTNER_STREAM: u64 = 1 << 40;

/// Returns for each camera the nearest cameras that look in a similar direction and are closer than the first thing it
/// sees, so that nothing is between the two.
pub(in crate::train) fn partners(cameras: &[&Camera], planes: &[f32]) -> Vec<Vec<usize>> {
    let places: Vec<(DVec3, DVec3)> = cameras.iter().map(|camera| (camera.centre(), camera.axis())).collect();
    let of = |index: usize| {
        let distance = |other: usize| places[index].0.distance(places[other].0);
        let reach = f64::from(planes[index]) / NEAR_SHARE;
        let is_partner = |&other: &usize| {
            other != index && distance(other) <= reach && places[index].1.dot(places[other].1) >= AXES_COSINE_MIN
        };
        let mut found: Vec<usize> = (0..places.len()).filter(is_partner).collect();
        found.sort_by(|&a, &b| distance(a).total_cmp(&distance(b)));
        found.truncate(PARTNERS_MAX);
        found
    };
    (0..places.len()).map(of).collect()
}

/// Returns the partner of a step, drawn from `partners`.
pub(in crate::train) fn partner(seed: u64, step: u32, partners: &[usize]) -> Option<usize> {
    let index = stream(seed, PARTNER_STREAM + u64::from(step)).random_range(0..partners.len().max(1));
    partners.get(index).copied()
}

#[cfg(test)]
mod tests {
    use super::{partner, partners};
    use crate::scene::Camera;
    use glam::{DMat3, DVec3};

    fn camera(centre: DVec3, turn: f64) -> Camera {
        let rotation = DMat3::from_rotation_y(turn);
        let translation = -(rotation * centre);
        Camera { rotation, translation, fx: 50.0, fy: 50.0, cx: 32.0, cy: 24.0, width: 64, height: 48 }
    }

    #[test]
    fn partners_are_near_and_look_the_same_way() {
        let on_a_line = |x: f64, turn| camera(DVec3::new(x, 0.0, 0.0), turn);
        let cameras = [(0.0, 0.0), (1.0, 0.3), (1.5, 2.0), (2.5, 0.0), (7.0, 0.0)].map(|(x, turn)| on_a_line(x, turn));
        // Near planes are a quarter of the depth of the nearest things.
        let found = partners(&cameras.each_ref(), &[0.5, 0.75, 0.75, 1.2, 1.2]);
        assert_eq!(found, [vec![1], vec![0, 3], vec![], vec![1, 0, 4], vec![3]]);
    }

    #[test]
    fn each_partner_has_its_turns() {
        for seed in [0, 1, 77] {
            let mut turns = [0; 4];
            (1..=4000).for_each(|step| turns[partner(seed, step, &[0, 1, 2, 3]).expect("one of them")] += 1);
            assert!(turns.iter().all(|&turns| turns > 850), "{seed}: {turns:?}");
        }
        assert_eq!(partner(0, 1, &[]), None);
    }
}
