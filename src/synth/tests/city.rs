//! The synthetic city: many objects, too large for a single photo, with every place in several photos.

use labelgs_files::LabelTable;
use labelgs_scene::Camera;
use labelgs_synth::{self as synth, World, cameras, trace_view};
use labelgs_synth::{Preset, SynthOptions};
use std::collections::BTreeSet;

fn small() -> SynthOptions {
    SynthOptions { width: 64, height: 48, ..SynthOptions::for_preset(Preset::City) }
}

/// Returns whether a camera sees a world position.
fn sees(world: &World, camera: &Camera, place: glam::DVec3) -> bool {
    let own = camera.to_camera(place);
    let at = camera.project(own);
    let is_inside = at.x >= 0.0 && at.y >= 0.0 && at.x < f64::from(camera.width) && at.y < f64::from(camera.height);
    let towards = place - camera.centre();
    let free = || world.hit(camera.centre(), towards.normalize()).distance > towards.length() * (1.0 - 1e-6);
    own.z > 0.0 && is_inside && free()
}

#[test]
fn sixty_objects_with_names_stand_apart() {
    let world = World::new(Preset::City, 0);
    assert!(world.objects.iter().map(|object| object.id).eq(1..=60));
    assert_eq!(world.objects.iter().map(|object| object.name).collect::<BTreeSet<_>>().len(), 60);
    for object in &world.objects {
        // A ray straight down from above hits the object alone.
        let above = object.position + glam::DVec3::Z * 8.0;
        for other in world.objects.iter().filter(|other| other.id != object.id) {
            assert_eq!(other.distance(above, -glam::DVec3::Z), None, "{} stands in {}", object.name, other.name);
        }
        // No other object is on the lines from its centre to its surface and back.
        for turn in 0..8 {
            let angle = f64::from(turn) * std::f64::consts::TAU / 8.0;
            let outward = glam::DVec3::new(angle.cos(), angle.sin(), 0.0);
            let start = object.position + outward * 5.0;
            let Some(enter) = object.distance(start, -outward) else { continue };
            for other in world.objects.iter().filter(|other| other.id != object.id) {
                let back = other.distance(object.position, outward);
                assert!(back.is_none_or(|at| at > 5.0 - enter), "{} reaches into {}", other.name, object.name);
            }
        }
    }
}

#[test]
fn cameras_are_in_the_open_and_see_every_object() {
    let world = World::new(Preset::City, 0);
    let cameras = cameras(&small());
    assert_eq!(cameras.len(), 200);
    let mut views = [0; 61];
    for (view, camera) in cameras.iter().enumerate().step_by(5) {
        let made = trace_view(&world, camera, view as u32);
        let nearest = made.depth.iter().copied().fold(f32::INFINITY, f32::min);
        assert!(nearest > 0.25, "view {view} has something before its lens, at {nearest}");
        made.ids.iter().collect::<BTreeSet<_>>().iter().for_each(|&&id| views[usize::from(id)] += 1);
    }
    assert!(views[1..].iter().all(|&count| count >= 2), "{views:?} of 40 views");
}

#[test]
fn every_place_is_seen_by_several_photos() {
    let world = World::new(Preset::City, 0);
    let cameras = cameras(&small());
    let mut counts = Vec::new();
    for x in -12..=12 {
        for y in -8..=8 {
            // What is there, from above.
            let above = glam::DVec3::new(f64::from(x) + 0.1, f64::from(y) + 0.1, 10.0);
            let place = world.hit(above, -glam::DVec3::Z).place;
            counts.push(cameras.iter().filter(|camera| sees(&world, camera, place)).count());
        }
    }
    counts.sort_unstable();
    assert!(counts[0] >= 3 && counts[counts.len() / 2] >= 10, "{counts:?}");
}

#[test]
fn a_photo_sees_mostly_one_quarter() {
    let world = World::new(Preset::City, 0);
    let cameras = cameras(&small());
    let mut shares: Vec<f64> = Vec::new();
    for (view, camera) in cameras.iter().enumerate().step_by(7) {
        let made = trace_view(&world, camera, view as u32);
        let mut quarters = [0_u32; 4];
        for (at, _) in made.ids.iter().enumerate().filter(|&(_, &id)| id > 0) {
            let (x, y) = ((at % 64) as f64 + 0.5, (at / 64) as f64 + 0.5);
            let own = glam::DVec3::new((x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy, 1.0);
            let place = camera.centre() + camera.rotation.transpose() * (own * f64::from(made.depth[at]));
            quarters[usize::from(place.x > 0.0) + 2 * usize::from(place.y > 0.0)] += 1;
        }
        let largest = quarters.iter().max().expect("four");
        shares.push(f64::from(*largest) / f64::from(quarters.iter().sum::<u32>().max(1)));
    }
    shares.sort_by(f64::total_cmp);
    // Some are at the border of quarters, and see two or four.
    let (least, half) = (shares[0], shares[shares.len() / 2]);
    assert!(least < 0.65 && half > 0.65, "{shares:?}");
}

#[test]
fn its_files_are_complete_and_photos_without_an_object_are_those_of_a_world_without_it() {
    let folder = tempfile::tempdir().expect("folder");
    let options =
        SynthOptions { width: 48, height: 36, views: 9, points: 150, ..SynthOptions::for_preset(Preset::City) };
    let summary = synth::write(&options, folder.path(), &|_| Ok(())).expect("written");
    assert_eq!((summary.points, summary.objects.len()), (150, 60));
    let table = LabelTable::read(&folder.path().join("masks/labels.json")).expect("the names");
    assert_eq!((table.labels[59].id, table.labels[59].name.as_deref()), (60, Some("lamp-6")));
    let count = |kind: &str| {
        let files = |id: u32| std::fs::read_dir(folder.path().join(format!("{kind}/{id}"))).expect("a folder").count();
        (1..=60).map(files).sum::<usize>()
    };
    assert_eq!(["amodal", "objects", "without", "shadowed"].map(count), [540, 540, 120, 120]);
    let world = World::new(options.preset, options.seed);
    let camera = &cameras(&options)[8];
    for (kind, shadow) in [("without", false), ("shadowed", true)] {
        for object in &world.objects {
            let file = image::open(folder.path().join(format!("{kind}/{}/008.png", object.id))).expect("PNG");
            let made = trace_view(&world.without(object.id, shadow), camera, 8);
            assert!(file.into_rgb8().into_raw() == made.rgb.as_flattened(), "{kind} {}", object.name);
        }
    }
}
