//! Ids from frame to frame by overlap, alone and on the video between sparse photos.

use labelgs::files::image::write_png_grey16;
use labelgs::label::masks::{Overlap, track};
use labelgs::masks::read_mask;
use labelgs::scene::path::{Interpolation, short_order, video};
use labelgs::scene::{Camera, LabelMap};
use labelgs::synth::{Fault, Preset, SynthOptions, spoil};
use labelgs::synth::{World, ring_of_cameras, trace_view};

const OVERLAP_OPTIONS: Overlap = Overlap { least: 0.1, memory: 5 };

fn row(ids: &[u16]) -> LabelMap {
    LabelMap { width: ids.len() as u32, height: 1, ids: ids.to_vec() }
}

fn tracked(frames: &[&[u16]], how: Overlap) -> Vec<Vec<u16>> {
    let frames: Vec<LabelMap> = frames.iter().map(|ids| row(ids)).collect();
    track(&frames, how).expect("few objects").into_iter().map(|map| map.ids).collect()
}

#[test]
fn regions_keep_the_id_of_what_they_overlap_most() {
    let moving: [&[u16]; 3] = [&[9, 9, 9, 0, 4, 4, 0], &[0, 4, 4, 4, 7, 7, 7], &[0, 0, 8, 8, 8, 1, 0]];
    // Region 4 of the middle frame shares two of four pixels with 9 of the first, and 7 two of three with 4.
    assert_eq!(
        tracked(&moving, OVERLAP_OPTIONS),
        [[2, 2, 2, 0, 1, 1, 0], [0, 2, 2, 2, 1, 1, 1], [0, 0, 2, 2, 2, 1, 0]]
    );
    let strict = Overlap { least: 0.6, ..OVERLAP_OPTIONS };
    assert_eq!(tracked(&moving[..2], strict)[1], [0, 3, 3, 3, 1, 1, 1], "two of four are too few, two of three not");
}

#[test]
fn an_object_out_of_sight_is_remembered_for_a_while() {
    let hidden: [&[u16]; 4] = [&[5, 5, 0], &[0, 0, 0], &[0, 0, 0], &[6, 6, 0]];
    assert_eq!(tracked(&hidden, Overlap { memory: 2, ..OVERLAP_OPTIONS })[3], [1, 1, 0]);
    assert_eq!(tracked(&hidden, Overlap { memory: 1, ..OVERLAP_OPTIONS })[3], [2, 2, 0]);
    assert!(tracked(&[], OVERLAP_OPTIONS).is_empty());
}

#[test]
fn too_many_objects_are_an_error() {
    // Missing for longer than the memory of the tracker, so every second frame has a new object.
    let frames = [row(&[1]), row(&[0])];
    let many: Vec<LabelMap> = frames.iter().cycle().take(2 * 65_536).cloned().collect();
    let forgetful = Overlap { memory: 0, ..OVERLAP_OPTIONS };
    assert_eq!(track(&many[..2 * 65_535], forgetful).expect("just enough")[2 * 65_534].ids, [65_535]);
    let error = track(&many, forgetful).expect_err("one too many").to_string();
    assert!(error.contains("65535 objects") && error.contains("min_overlap"), "{error}");
}

#[test]
fn the_verb_reads_and_writes_folders() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    for (name, ids) in [("00000", [7, 7, 0]), ("00001", [0, 300, 300])] {
        write_png_grey16(path(&format!("segmented/{name}.png")), 3, 1, &ids).expect("written");
    }
    let run = |output: &str| {
        let mut command = assert_cmd::Command::cargo_bin("labelgs").expect("the tool is built");
        let output =
            command.args(["masks", "track", &path("segmented"), "-o", &path(output)]).output().expect("it runs");
        (output.status.code(), String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).into_owned())
    };
    let (status, text) = run("tracked");
    assert!(status == Some(0) && text.contains("1 objects in 2 frames"), "{text}");
    let read = |name: &str| read_mask(path(&format!("tracked/{name}.png"))).expect("a mask").ids;
    assert_eq!((read("00000"), read("00001")), (vec![1, 1, 0], vec![0, 1, 1]));
    let (status, text) = run("tracked");
    assert!(status == Some(2) && text.contains("not empty"), "{text}");
    write_png_grey16(path("segmented/00002.png"), 1, 3, &[1, 1, 1]).expect("written");
    let (status, text) = run("again");
    assert!(status == Some(3) && text.contains("00002.png") && text.contains("1 x 3 px"), "{text}");
}

/// Mean IoU with the ground truth over objects and photos. An object keeps the id of its first appearance.
fn score(truth: &[LabelMap], found: &[LabelMap]) -> f64 {
    let mut shares = Vec::new();
    for object in 1..=8_u16 {
        let seen: Vec<usize> = (0..truth.len()).filter(|&view| truth[view].ids.contains(&object)).collect();
        let Some((&first, others)) = seen.split_first() else { continue };
        let pixel = truth[first].ids.iter().position(|&id| id == object).expect("seen");
        let id = found[first].ids[pixel];
        for &view in others {
            let pairs = || truth[view].ids.iter().zip(&found[view].ids).map(|(&a, &b)| (a == object, b == id));
            let both = pairs().filter(|&(a, b)| a && b).count() as f64;
            shares.push(both / pairs().filter(|&(a, b)| a || b).count() as f64);
        }
    }
    shares.iter().sum::<f64>() / shares.len() as f64
}

/// View densification of LabelGS: what a tracker gains from frames between eight photos. The frames are ground truth,
/// so the numbers do not depend on a model.
#[test]
fn frames_between_sparse_photos_keep_ids() {
    let options = SynthOptions {
        preset: Preset::Default,
        width: 96,
        height: 72,
        views: 8,
        points: 10,
        seed: 0,
        ..SynthOptions::default()
    };
    let (world, cameras) = (World::new(options.preset, options.seed), ring_of_cameras(&options));
    let cameras: Vec<&Camera> = cameras.iter().collect();
    let cameras: Vec<&Camera> = short_order(&cameras).into_iter().map(|index| cameras[index]).collect();
    let ids_at = |camera: &Camera, number: usize| {
        let ids = trace_view(&world, camera, number as u32).ids.into_iter().map(u16::from).collect();
        LabelMap { width: camera.width, height: camera.height, ids }
    };
    let mut table = Vec::new();
    for between in [0, 9] {
        let stops = video(&cameras, between, Interpolation::Centres);
        let truth: Vec<LabelMap> = stops.iter().zip(0..).map(|(stop, at)| ids_at(&stop.camera, at)).collect();
        let segmented: Vec<LabelMap> = spoil(&truth, Fault::PerView, 1.0, 5).into_iter().flatten().collect();
        let found = track(&segmented, OVERLAP_OPTIONS).expect("few objects");
        let photos = |maps: &[LabelMap]| -> Vec<LabelMap> {
            maps.iter().zip(&stops).filter(|(_, stop)| stop.camera_index.is_some()).map(|(m, _)| m.clone()).collect()
        };
        table.push((between, score(&photos(&truth), &photos(&found)), score(&photos(&truth), &photos(&segmented))));
        let (_, tracked, single) = table[table.len() - 1];
        println!("{between} frames between two photos: mIoU {tracked:.3} tracked, {single:.3} without a tracker");
    }
    let [none, nine] = table[..] else { unreachable!("two rows") };
    assert!(none.2 < 0.2, "ids that differ in every view are no object: {}", none.2);
    assert!(nine.1 > none.1 + 0.3, "{table:?}");
}
