//! Opacities of objects that stand alone are fitted to photos and masks.

use crate::support::device;
use glam::{DVec2, DVec3};
use labelgs::scene::{Camera, Gaussians, LabelMap, Occluders, Photo, View};
use labelgs::scheduler::SchedulerOptions;
use labelgs::synth::{SynthOptions, ring_of_cameras};
use labelgs::train::refit::{REFIT_STEPS, refitted};
use labelgs::{Error, Result};
use std::collections::BTreeMap;

/// Where the cameras look; there is a ball.
const OBJECT_CENTRE: DVec3 = DVec3::new(0.0, 0.0, 0.42);
const OBJECT_RADIUS: f64 = 0.35;

fn view((index, camera): (usize, Camera)) -> View {
    let (width, height) = (camera.width, camera.height);
    let seen = camera.sees(OBJECT_CENTRE).expect("it is before the camera");
    let reach = camera.fx * OBJECT_RADIUS / camera.centre().distance(OBJECT_CENTRE);
    let inside = |p: u32| DVec2::new(f64::from(p % width) + 0.5, f64::from(p / width) + 0.5).distance(seen) < reach;
    let pixels = || (0..width * height).map(inside);
    let colour = |inside| if inside { [200, 60, 40, 255] } else { [90, 110, 130, 255] };
    View {
        name: format!("{index}.png"),
        photo: Some(Photo { width, height, rgba: pixels().map(colour).collect() }.into()),
        mask: Some(LabelMap { width, height, ids: pixels().map(u16::from).collect() }.into()),
        camera,
    }
}

fn views() -> Vec<View> {
    let options = SynthOptions { width: 48, height: 36, views: 6, ..SynthOptions::default() };
    ring_of_cameras(&options).into_iter().enumerate().map(view).collect()
}

/// The ball, too faint, and haze over and under it.
fn object() -> Gaussians {
    let places = [OBJECT_CENTRE, OBJECT_CENTRE + 1.2 * DVec3::Z, OBJECT_CENTRE - 1.2 * DVec3::Z];
    Gaussians {
        origin: DVec3::ZERO,
        means: places.iter().map(|place| place.as_vec3().to_array()).collect(),
        quats: vec![[1.0, 0.0, 0.0, 0.0]; 3],
        scales: vec![[-1.8; 3], [-3.0; 3], [-3.0; 3]],
        opacities: vec![0.0; 3],
        sh0: vec![[1.0, -0.9, -1.2]; 3],
        sh_rest: Vec::new(),
        sh_degree: 0,
        antialiased: false,
        labels: Some(vec![1; 3]),
        label_confidence: Some(vec![0.9; 3]),
    }
}

fn refit(object: &Gaussians, occluders: &BTreeMap<String, Occluders>) -> Option<Result<Gaussians>> {
    let turn = device()?;
    let (all, mut steps) = (views(), 0);
    let (views, scheduler) = (all.iter().collect::<Vec<_>>(), SchedulerOptions::default());
    let found = refitted(&turn.gpu(), object, (&views, occluders), 0.2, scheduler, &mut |step| steps = step);
    assert!(found.is_err() || steps == REFIT_STEPS, "it tells how far it is");
    Some(found)
}

#[test]
fn haze_goes_from_a_copy_and_nothing_else_changes() {
    let object = object();
    let Some(found) = refit(&object, &BTreeMap::new()) else { return };
    let found = found.expect("a copy");
    assert!(found.opacities[0] > 1.0, "the ball is solid: {:?}", found.opacities);
    assert!(found.opacities[1..].iter().all(|&logit| logit < -2.0), "{:?}", found.opacities);
    assert_eq!(Gaussians { opacities: object.opacities.clone(), ..found }, object);
}

/// Where something hides the object, the mask does not tell whether it is there; nor does the photo, which shows the
/// scene.
#[test]
fn haze_that_something_may_hide_stays() {
    let object = object();
    let hidden = views().iter().map(|view| (view.name.clone(), Occluders::from([(1, vec![0])]))).collect();
    let Some(found) = refit(&object, &hidden) else { return };
    let found = found.expect("a copy");
    assert!(found.opacities[0] > 1.0, "{:?}", found.opacities);
    assert!(found.opacities[1..].iter().all(|&logit| logit.abs() < 1e-3), "{:?}", found.opacities);
}

#[test]
fn a_label_without_a_mask_is_refused() {
    let object = Gaussians { labels: Some(vec![1, 1, 7]), ..object() };
    let Some(Err(Error::Usage { argument, problem })) = refit(&object, &BTreeMap::new()) else {
        return assert!(device().is_none(), "label 7 has no mask");
    };
    assert!(argument == "masks" && problem.contains("label 7"), "{argument}: {problem}");
}
