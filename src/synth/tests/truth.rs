//! A synthetic scene is consistent: images, masks, depth and points agree.

use glam::DVec3;
use labelgs_files::LabelTable;
use labelgs_masks::read_mask;
use labelgs_scene::{Camera, Error};
use labelgs_scenes::LoadOptions;
use labelgs_synth::{
    self as synth, Preset, SynthOptions, TracedView, World, ring_of_cameras, trace_isolated, trace_view,
};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

fn small() -> SynthOptions {
    SynthOptions { width: 64, height: 48, views: 6, points: 60, ..SynthOptions::default() }
}

/// All files under a folder with their bytes.
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
        let made = trace_view(&world, camera, view as u32);
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
        let ids = view.mask().expect("read").expect("a mask").ids.clone();
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
    let made: Vec<_> =
        cameras.iter().enumerate().map(|(view, camera)| trace_view(&world, camera, view as u32)).collect();
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
            // Visible in both views: both must name the same object.
            if (f64::from(made[1].depth[other]) - own.z).abs() < 0.02 * own.z {
                seen += 1;
                same += usize::from(made[0].ids[index] == made[1].ids[other]);
            }
        }
    }
    assert!(seen > 500 && f64::from(same as u32) > 0.95 * f64::from(seen as u32), "{same} of {seen}");
}

fn unproject(camera: &Camera, x: f64, y: f64, z: f64) -> DVec3 {
    let own = glam::DVec3::new((x - camera.cx) / camera.fx * z, (y - camera.cy) / camera.fy * z, z);
    camera.rotation.transpose() * (own - camera.translation)
}

#[test]
fn a_ball_has_its_own_outline() {
    let world = World::new(Preset::Simple, 0);
    let (index, ball) = world.objects.iter().enumerate().find(|(_, object)| object.name == "ball").expect("ball");
    for camera in ring_of_cameras(&small()) {
        let made = trace_view(&world, &camera, 0);
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
    // Per view a photo, a mask, a depth map, 8 whole outlines and 8 isolated objects; 3 COLMAP files; the names; in the
    // held-out view photos without each of 8 objects, with its shadow and without.
    assert_eq!(a.len(), 6 * 19 + 4 + 16);
    assert!(a.values().eq(b.values()), "two runs differ");
    assert_ne!(a[&first.join("images/000.png")], c[&other.join("images/000.png")]);
    let table = LabelTable::read(&first.join("masks/labels.json")).expect("the names");
    assert_eq!((table.labels[0].id, table.labels[0].name.as_deref()), (1, Some("crate")));
    let mut counted = [(0_u64, 0_u32); 9];
    for view in 0..6 {
        let mask = read_mask(first.join(format!("masks/{view:03}.png"))).expect("mask");
        mask.ids.iter().for_each(|&id| counted[usize::from(id)].0 += 1);
        mask.objects().iter().for_each(|&id| counted[usize::from(id)].1 += 1);
    }
    let told: Vec<_> = table.labels.iter().map(|entry| (entry.pixels, entry.views)).collect();
    assert_eq!(told, counted[1..]);
    let file = image::open(first.join("objects/2/000.png")).expect("PNG").into_rgba8();
    let world = World::new(options.preset, options.seed);
    let made = synth::trace_isolated(&world, &ring_of_cameras(&options)[0], 0, 1);
    assert_eq!(file.into_raw(), made.concat());
}

#[test]
fn a_world_without_an_object_has_its_shadow_or_not() {
    let world = World::new(Preset::Simple, 0);
    let camera = &ring_of_cameras(&small())[0];
    let made = trace_view(&world, camera, 0);
    for object in &world.objects {
        let (bare, shadowed) = (world.without(object.id, false), world.without(object.id, true));
        let (bare, shadowed) = (trace_view(&bare, camera, 0), trace_view(&shadowed, camera, 0));
        assert_eq!((&bare.ids, &bare.depth), (&shadowed.ids, &shadowed.depth));
        assert!(!bare.ids.contains(&object.id), "object {} is still there", object.id);
        let (mut lighter, mut other) = (0, 0);
        for at in 0..made.ids.len() {
            // Away from the object, photos differ only by its shadow.
            if is_other(&made, at, object.id) {
                assert_eq!(shadowed.rgb[at], made.rgb[at]);
                other += 1;
                let sum = |rgb: [u8; 3]| rgb.map(u32::from).into_iter().sum::<u32>();
                assert!(sum(bare.rgb[at]) >= sum(made.rgb[at]), "without a shadow nothing is darker");
                lighter += u32::from(sum(bare.rgb[at]) > sum(made.rgb[at]) + 30);
            }
        }
        assert!(other > 1000 && lighter > 5, "object {}: {lighter} of {other} pixels", object.id);
    }
}

#[test]
fn the_reader_finds_what_was_made() {
    let folder = tempfile::tempdir().expect("folder");
    let options = SynthOptions { views: 9, ..small() };
    synth::write(&options, folder.path(), &|_| Ok(())).expect("written");
    let load = LoadOptions { masks: Some(folder.path().join("masks")), ..LoadOptions::default() };
    let read = labelgs_scenes::open(folder.path(), &load).expect("read");
    let made = synth::dataset(&options, 8);
    assert_eq!((read.train.len(), read.test.len()), (7, 2));
    for (read, made) in read.all().into_iter().zip(made.all()) {
        assert_eq!((&read.name, read.photo().expect("read")), (&made.name, made.photo().expect("made")));
        assert_eq!(read.mask().expect("read"), made.mask().expect("made"));
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
    assert!(matches!(error, Error::Usage { .. }), "{error}");
    assert!(error.to_string().contains("not empty"), "{error}");
}

/// True where no pixel in the neighbourhood has `id`.
fn is_other(made: &TracedView, at: usize, id: u8) -> bool {
    let (width, height) = (made.width as usize, made.height as usize);
    let (x, y) = (at % width, at / width);
    let inside = (1..width - 1).contains(&x) && (1..height - 1).contains(&y);
    inside && (y - 1..=y + 1).all(|y| (x - 1..=x + 1).all(|x| made.ids[y * width + x] != id))
}

/// True where all pixels in the neighbourhood have `id`.
fn is_inner(made: &TracedView, at: usize, id: u8) -> bool {
    let (width, height) = (made.width as usize, made.height as usize);
    let (x, y) = (at % width, at / width);
    let inside = (1..width - 1).contains(&x) && (1..height - 1).contains(&y);
    inside && (y - 1..=y + 1).all(|y| (x - 1..=x + 1).all(|x| made.ids[y * width + x] == id))
}

#[test]
fn an_object_alone_is_the_photo_where_nothing_hides_it() {
    let options = SynthOptions { width: 128, height: 96, ..small() };
    let world = World::new(Preset::Default, 0);
    for (view, camera) in ring_of_cameras(&options).iter().enumerate().take(3) {
        let made = trace_view(&world, camera, view as u32);
        let (mut compared, mut slivers, mut hidden) = (0, 0, 0);
        for (index, object) in world.objects.iter().enumerate() {
            let alone = trace_isolated(&world, camera, view as u32, index);
            for (at, &[r, g, b, alpha]) in alone.iter().enumerate() {
                assert_eq!(alpha == 255, made.whole[index][at], "alpha is the whole outline");
                assert!(alpha == 255 || [r, g, b, alpha] == [0; 4], "nothing is black and transparent");
                if is_inner(&made, at, object.id) {
                    compared += 1;
                    slivers += usize::from([r, g, b] != made.rgb[at]);
                }
                hidden += usize::from(alpha == 255 && made.ids[at] != object.id && [r, g, b] != made.rgb[at]);
            }
        }
        assert!(compared > 800 && hidden > 100, "{compared} pixels compared, {hidden} hidden ones have own colours");
        // Tips of other objects lie between the centres of pixels.
        assert!(slivers * 200 <= compared, "{slivers} of {compared} pixels of view {view} differ");
    }
}

/// The hard scene at half its default size.
fn hard() -> (World, Vec<Camera>, Vec<TracedView>) {
    let world = World::new(Preset::Hard, 0);
    let options = SynthOptions { width: 160, height: 120, ..SynthOptions::default() };
    let cameras: Vec<Camera> = ring_of_cameras(&options).into_iter().step_by(5).collect();
    let made = cameras.iter().enumerate().map(|(view, camera)| trace_view(&world, camera, view as u32)).collect();
    (world, cameras, made)
}

fn index_of(world: &World, name: &str) -> usize {
    world.objects.iter().position(|object| object.name == name).unwrap_or_else(|| panic!("no {name}"))
}

/// Mean length of the runs of `true` along rows of `width`.
fn mean_run(pixels: &[bool], width: usize) -> f64 {
    let starts = |row: &[bool]| (0..row.len()).filter(|&x| row[x] && (x == 0 || !row[x - 1])).count();
    let runs: usize = pixels.chunks(width).map(starts).sum();
    pixels.iter().filter(|&&pixel| pixel).count() as f64 / runs as f64
}

#[test]
fn the_hard_scene_has_thin_cut_dark_and_hidden_objects() {
    let (world, cameras, made) = hard();
    let (width, height) = (made[0].width as usize, made[0].height as usize);
    let views = made.len() as u32 as f64;
    let seen = |name: &str| {
        let id = world.objects[index_of(&world, name)].id;
        made.iter().map(|made| made.ids.iter().filter(|&&pixel| pixel == id).count()).collect::<Vec<_>>()
    };
    for object in &world.objects {
        assert!(seen(object.name).iter().filter(|&&pixels| pixels > 8).count() >= 2, "{} is not seen", object.name);
    }

    for name in ["fence", "wire"] {
        let index = index_of(&world, name);
        let widths = made.iter().map(|made| {
            let columns: Vec<bool> = (0..width)
                .flat_map(|x| (0..height).map(move |y| y * width + x))
                .map(|at| made.whole[index][at])
                .collect();
            mean_run(&made.whole[index], width).min(mean_run(&columns, height))
        });
        // Twice as wide at the default size.
        let mean = widths.sum::<f64>() / views;
        assert!(mean < 2.0, "{name} is {mean} px wide");
    }

    for name in ["mast", "plank"] {
        let index = index_of(&world, name);
        let border = |at: usize| [0, width - 1].contains(&(at % width)) || [0, height - 1].contains(&(at / width));
        let cut = made.iter().filter(|made| (0..width * height).any(|at| border(at) && made.whole[index][at])).count();
        assert!(cut * 3 >= made.len(), "the border cuts {name} in {cut} of {} views", made.len());
    }

    let sums = cameras.iter().enumerate().flat_map(|(view, camera)| {
        trace_isolated(&world, camera, view as u32, index_of(&world, "coal"))
            .into_iter()
            .filter(|pixel| pixel[3] == 255)
    });
    let coal: Vec<[u8; 4]> = sums.collect();
    let mean = coal.iter().flat_map(|pixel| pixel[..3].to_vec()).map(f64::from).sum::<f64>() / (3 * coal.len()) as f64;
    assert!(mean < 8.0, "coal has {mean} of 255");

    for name in ["apple", "die"] {
        let index = index_of(&world, name);
        let hidden = seen(name).iter().filter(|&&pixels| pixels == 0).count();
        assert!(hidden >= 1, "{name} is seen in every view");
        assert!(made.iter().any(|made| made.whole[index].contains(&true)), "{name} is not even in the picture");
    }
}

#[test]
fn the_flagstone_looks_like_the_ground_and_the_twins_touch() {
    let (world, cameras, made) = hard();
    // The photo without the object, at the object's pixels.
    let change = |name: &str| {
        let index = index_of(&world, name);
        let mut without = world.clone();
        let id = without.objects.remove(index).id;
        let (mut sum, mut count) = (0.0, 0);
        for (view, (camera, made)) in cameras.iter().zip(&made).enumerate().take(3) {
            let empty = trace_view(&without, camera, view as u32);
            for at in (0..made.ids.len()).filter(|&at| made.ids[at] == id) {
                sum += (0..3).map(|c| f64::from(made.rgb[at][c].abs_diff(empty.rgb[at][c]))).sum::<f64>() / 3.0;
                count += 1;
            }
        }
        sum / f64::from(count)
    };
    let (flagstone, bin) = (change("flagstone"), change("bin"));
    assert!(flagstone < 15.0 && bin > 2.0 * flagstone, "flagstone {flagstone}, bin {bin}");

    let [brick, twin] = ["brick", "twin"].map(|name| world.objects[index_of(&world, name)].id);
    let touching = made.iter().filter(|made| {
        let pairs = (1..made.ids.len()).filter(|&at| {
            (made.ids[at - 1], made.ids[at]) == (brick, twin) || (made.ids[at - 1], made.ids[at]) == (twin, brick)
        });
        // The depth is the same on both sides of the seam.
        pairs.filter(|&at| (made.depth[at] / made.depth[at - 1] - 1.0).abs() < 0.01).count() > 2
    });
    let touching = touching.count();
    assert!(touching >= 3, "the seam is seen in {touching} views");
}

/// The point where a ray enters a shape is at distance 0, and a step along the normal is as far away.
#[test]
fn distances_agree_with_rays() {
    for preset in [Preset::Default, Preset::Hard] {
        let world = World::new(preset, 0);
        for (index, object) in world.objects.iter().enumerate() {
            let mut met = 0;
            for at in 0..200 {
                let (z, turn) = (1.0 - f64::from(2 * at + 1) / 200.0, 2.4 * f64::from(at));
                let from = DVec3::new(turn.cos(), turn.sin(), 0.0) * (1.0 - z * z).sqrt() + DVec3::Z * z;
                let origin = object.position + 3.0 * object.shape.bound() * from;
                let aim = object.position + 0.3 * object.shape.bound() * DVec3::new(z, turn.sin(), turn.cos());
                let Some(hit) = world.hit_object(index, origin, (aim - origin).normalize()) else { continue };
                met += 1;
                let step = 1e-3 * object.shape.bound();
                let [on, out] = [0.0, step].map(|step| object.distance_to(hit.place + step * hit.normal));
                assert!(on.abs() < 1e-5, "{}: {on} at a hit", object.name);
                // Another part or side may be nearer, but not through the surface.
                assert!(out > 0.0 && out < 1.02 * step, "{}: {out} after a step of {step}", object.name);
            }
            assert!(met > 10, "{}: {met} rays met it", object.name);
        }
    }
}
