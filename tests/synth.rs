//! The made scene: its pictures, masks, depth and points must agree with each other.

use labelgs::io::LoadOptions;
use labelgs::scene::Camera;
use labelgs::synth::{self, Preset, SynthOptions, World, picture, ring_of_cameras};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

fn small() -> SynthOptions {
    SynthOptions { width: 64, height: 48, views: 6, points: 60, ..SynthOptions::default() }
}

/// Every file under a folder with its bytes.
fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in std::fs::read_dir(folder).expect("folder") {
        let path = entry.expect("entry").path();
        if path.is_dir() {
            found.extend(files(&path));
        } else {
            found.insert(path.clone(), std::fs::read(&path).expect("file"));
        }
    }
    found
}

#[test]
fn visible_pixels_belong_to_the_whole_object() {
    let world = World::new(Preset::Default, 0);
    for (view, camera) in ring_of_cameras(&small()).iter().enumerate() {
        let made = picture(&world, camera, view as u32);
        let mut hidden = 0;
        for (object, whole) in world.objects.iter().zip(&made.whole) {
            for (&id, &covered) in made.ids.iter().zip(whole) {
                assert!(covered || id != object.id, "object {} is seen outside its own outline", object.id);
                hidden += usize::from(covered && id != object.id);
            }
        }
        assert!(hidden > 0, "view {view} has no occlusion");
    }
}

#[test]
fn every_object_is_seen_often() {
    let dataset = synth::dataset(&SynthOptions { views: 12, ..small() }, 8);
    assert_eq!((dataset.train.len(), dataset.test.len()), (10, 2));
    let mut views = [0; 9];
    for view in dataset.all() {
        let ids = &view.mask.as_ref().expect("mask").ids;
        assert!(ids.contains(&0));
        (1..=8_u16).for_each(|id| views[usize::from(id)] += usize::from(ids.contains(&id)));
    }
    assert!(views[1..].iter().all(|&count| count >= 8), "{views:?}");
    assert_eq!(dataset.points.len(), 60);
}

#[test]
fn depth_and_ids_agree_between_views() {
    let world = World::new(Preset::Simple, 3);
    let cameras = ring_of_cameras(&small());
    let made: Vec<_> = cameras.iter().enumerate().map(|(view, camera)| picture(&world, camera, view as u32)).collect();
    let (mut same, mut seen) = (0, 0);
    for y in 0..48 {
        for x in 0..64 {
            let index = y * 64 + x;
            let z = f64::from(made[0].depth[index]);
            let place = unproject(&cameras[0], x as f64 + 0.5, y as f64 + 0.5, z);
            let own = cameras[1].to_camera(place);
            let there = cameras[1].project(own).floor();
            if own.z <= 0.0 || !(0.0..64.0).contains(&there.x) || !(0.0..48.0).contains(&there.y) {
                continue;
            }
            let other = there.y as usize * 64 + there.x as usize;
            // Visible there too: then both views must name the same object.
            if (f64::from(made[1].depth[other]) - own.z).abs() < 0.02 * own.z {
                seen += 1;
                same += usize::from(made[0].ids[index] == made[1].ids[other]);
            }
        }
    }
    assert!(seen > 500 && f64::from(same as u32) > 0.95 * f64::from(seen as u32), "{same} of {seen}");
}

fn unproject(camera: &Camera, x: f64, y: f64, z: f64) -> glam::DVec3 {
    let own = glam::DVec3::new((x - camera.cx) / camera.fx * z, (y - camera.cy) / camera.fy * z, z);
    camera.rotation.transpose() * (own - camera.translation)
}

#[test]
fn a_ball_has_its_own_outline() {
    let world = World::new(Preset::Simple, 0);
    let (index, ball) = world.objects.iter().enumerate().find(|(_, object)| object.name == "ball").expect("ball");
    for camera in ring_of_cameras(&small()) {
        let made = picture(&world, &camera, 0);
        let centre = camera.to_camera(ball.position);
        for (pixel, &covered) in made.whole[index].iter().enumerate() {
            let (x, y) = ((pixel % 64) as f64 + 0.5, (pixel / 64) as f64 + 0.5);
            let ray = glam::DVec3::new((x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy, 1.0).normalize();
            let distance = (centre - ray * centre.dot(ray)).length();
            if (distance - 0.4).abs() > 1e-6 {
                assert_eq!(covered, distance < 0.4);
            }
        }
    }
}

#[test]
fn files_are_complete_and_the_same_every_time() {
    let folder = tempfile::tempdir().expect("folder");
    let (first, again, other) = (folder.path().join("a"), folder.path().join("b"), folder.path().join("c"));
    let options = small();
    let summary = synth::write(&options, &first, &|_| Ok(())).expect("written");
    assert_eq!((summary.views, summary.points, summary.objects.len()), (6, 60, 8));
    synth::write(&options, &again, &|_| Ok(())).expect("written");
    synth::write(&SynthOptions { seed: 1, ..options }, &other, &|_| Ok(())).expect("written");
    let (a, b, c) = (files(&first), files(&again), files(&other));
    // Per view a photo, a mask, a depth map and 8 whole objects; 3 of COLMAP; the names.
    assert_eq!(a.len(), 6 * 11 + 4);
    assert!(a.values().eq(b.values()), "two runs differ");
    assert_ne!(a[&first.join("images/000.png")], c[&other.join("images/000.png")]);
    let labels: serde_json::Value = serde_json::from_slice(&a[&first.join("labels.json")]).expect("JSON");
    assert_eq!((&labels[0]["id"], &labels[0]["name"]), (&1.into(), &"crate".into()));
}

#[test]
fn the_reader_finds_what_was_made() {
    let folder = tempfile::tempdir().expect("folder");
    let options = SynthOptions { views: 9, ..small() };
    synth::write(&options, folder.path(), &|_| Ok(())).expect("written");
    let load = LoadOptions { masks: Some(folder.path().join("masks")), ..LoadOptions::default() };
    let read = labelgs::io::open(folder.path(), &load).expect("read");
    let made = synth::dataset(&options, 8);
    assert_eq!((read.train.len(), read.test.len()), (7, 2));
    for (read, made) in read.all().into_iter().zip(made.all()) {
        assert_eq!((&read.name, &read.photo, &read.mask), (&made.name, &made.photo, &made.mask));
        let (a, b) = (&read.camera, &made.camera);
        assert!(a.rotation.abs_diff_eq(b.rotation, 1e-12) && a.translation.abs_diff_eq(b.translation, 1e-12));
        assert_eq!((a.fx, a.fy, a.cx, a.cy), (b.fx, b.fy, b.cx, b.cy));
    }
    assert_eq!(read.points, made.points);
}

#[test]
fn a_filled_folder_is_left_alone() {
    let folder = tempfile::tempdir().expect("folder");
    std::fs::write(folder.path().join("mine.txt"), "mine").expect("file");
    let error = synth::write(&small(), folder.path(), &|_| Ok(())).expect_err("not empty");
    assert_eq!(error.exit_status(), 2);
    assert!(error.to_string().contains("not empty"), "{error}");
}
