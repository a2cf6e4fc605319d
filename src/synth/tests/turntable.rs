//! On a turntable, only the object follows the poses.

use labelgs_scene::Dataset;
use labelgs_scenes::capture::still_share;
use labelgs_synth::{self as synth, Preset, SynthOptions};

fn made(preset: Preset) -> Dataset {
    let options = SynthOptions { width: 64, height: 48, views: 18, points: 150, ..SynthOptions::for_preset(preset) };
    synth::dataset(&options, 0)
}

/// The photos show the object's points, by their poses, in the points' colours and within the masks.
#[test]
fn the_object_follows_the_poses() {
    for preset in [Preset::Turntable, Preset::TurnedOver] {
        let dataset = made(preset);
        assert!(dataset.points.len() >= 100, "{} points", dataset.points.len());
        let (mut inside, mut outside) = (0, 0);
        for view in &dataset.train {
            let mask = view.mask().expect("read").expect("a mask");
            for point in &dataset.points {
                let at = view.camera.sees(point.position).expect("in the picture");
                // Points have errors of a few thousandths of their distance.
                let is_shown = mask.near_contour(1)[at.y as usize * 64 + at.x as usize];
                let on = mask.at(at.x as u32, at.y as u32) == 1 || is_shown;
                if on { inside += 1 } else { outside += 1 }
            }
        }
        assert!(outside * 100 < inside, "{preset:?}: {outside} outside, {inside} inside");
        assert!(dataset.train.iter().all(|view| view.mask().expect("read").expect("a mask").objects() == [1]));
    }
}

/// Both are recognised as turned, with and without masks; a scene with its own surroundings is not, even with few
/// photos.
#[test]
fn surroundings_that_stay_are_found() {
    let share = |preset: Preset, with_masks: bool| {
        let mut dataset = made(preset);
        if !with_masks {
            dataset.train.iter_mut().for_each(|view| view.mask = None);
        }
        still_share(&dataset).expect("measured")
    };
    for with_masks in [false, true] {
        for preset in [Preset::Turntable, Preset::TurnedOver] {
            let found = share(preset, with_masks).expect("it is found");
            assert!(found > 0.8, "{preset:?}: {found}");
        }
        for preset in [Preset::Default, Preset::Simple, Preset::Hard, Preset::City] {
            assert_eq!(share(preset, with_masks), None, "{preset:?}");
        }
    }
    let mut few = made(Preset::Turntable);
    few.train.truncate(4);
    assert_eq!(still_share(&few).expect("measured"), None);
}
