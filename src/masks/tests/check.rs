//! `masks check` finds each kind of planted problem, and none in clean masks.

use super::forms::*;
use glam::{DMat3, DVec3};
use labelgs_files::image::write_png_grey8;
use labelgs_masks::check::{MaskStats, findings};
use labelgs_masks::{Finding, Problem, Report, inspect};
use labelgs_scene::{Camera, Dataset, LabelMap, Point};
use labelgs_scenes::{self as scenes, LoadOptions};
use labelgs_synth as synth;
use labelgs_synth::SynthOptions;
use std::fs;
use std::path::Path;
use std::sync::LazyLock;
use tempfile::TempDir;

const MASK_WIDTH: u32 = 96;
const MASK_HEIGHT: u32 = 72;

/// A synthetic scene of 24 views with ray-traced masks.
static SYNTHETIC_SCENE: LazyLock<Dataset> = LazyLock::new(|| {
    let options =
        SynthOptions { width: MASK_WIDTH, height: MASK_HEIGHT, views: 24, points: 800, ..SynthOptions::default() };
    synth::dataset(&options, 0)
});

/// The scene, and a folder with its masks in `masks`.
fn made() -> (TempDir, &'static Dataset) {
    let folder = tempfile::tempdir().expect("folder");
    for view in SYNTHETIC_SCENE.all() {
        let map = view.mask().expect("read").expect("a mask");
        let ids: Vec<u8> = map.ids.iter().map(|&id| id as u8).collect();
        write_png_grey8(folder.path().join("masks").join(&view.name), map.width, map.height, &ids).expect("written");
    }
    (folder, &SYNTHETIC_SCENE)
}

fn report(folder: &TempDir, dataset: &Dataset) -> Report {
    inspect(dataset, &folder.path().join("masks")).expect("a report")
}

/// Changes the ids of one mask.
fn edit(folder: &TempDir, name: &str, change: impl Fn(usize, u16) -> u16) {
    let path = folder.path().join("masks").join(name);
    let map = labelgs_masks::read_mask(&path).expect("a mask");
    let ids: Vec<u8> = map.ids.iter().enumerate().map(|(index, &id)| change(index, id) as u8).collect();
    write_png_grey8(&path, map.width, map.height, &ids).expect("written");
}

fn short(findings: &[Finding]) -> Vec<(Problem, Option<&str>, Option<u32>)> {
    findings.iter().map(|finding| (finding.problem, finding.view.as_deref(), finding.id)).collect()
}

#[test]
fn clean_masks_give_nothing() {
    let (folder, dataset) = made();
    let report = report(&folder, dataset);
    assert_eq!(report.findings, []);
    assert_eq!((report.photos, report.masks, report.ids), (24, 24, (1..=8).collect::<Vec<u32>>()));
}

#[test]
fn files_that_do_not_fit_their_photos_are_found() {
    let (folder, dataset) = made();
    let masks = folder.path().join("masks");
    fs::rename(masks.join("003.png"), masks.join("3.png")).expect("renamed");
    write_png_grey8(masks.join("005.png"), 72, 72, &[1; 72 * 72]).expect("written");
    // Half of the size is a scale.
    write_png_grey8(
        masks.join("006.png"),
        MASK_WIDTH / 2,
        MASK_HEIGHT / 2,
        &vec![1; (MASK_WIDTH * MASK_HEIGHT / 4) as usize],
    )
    .expect("written");
    fs::write(masks.join("007.png"), "text").expect("written");
    png(
        &masks.join("008.png"),
        (MASK_WIDTH, MASK_HEIGHT),
        png::ColorType::Rgb,
        png::BitDepth::Eight,
        &[1, 2, 3].repeat(96 * 72),
    );
    fs::write(masks.join("009.jpg"), "text").expect("written");
    fs::write(masks.join("labels.json"), "belongs here").expect("written");
    let report = report(&folder, dataset);
    let files = report.findings.iter().filter(|finding| finding.problem <= Problem::Unreadable);
    let files: Vec<Finding> = files.cloned().collect();
    let expected = [
        (Problem::Missing, Some("003.png"), None),
        (Problem::Misnamed, None, None),
        (Problem::Misnamed, None, None),
        (Problem::Missized, Some("005.png"), None),
        (Problem::Unreadable, Some("007.png"), None),
        (Problem::Unreadable, Some("008.png"), None),
    ];
    assert_eq!(short(&files), expected);
    assert!(files[1].text.contains("009.jpg") && files[2].text.contains("3.png"), "{files:?}");
    assert!(files[3].text.contains("72 x 72 px") && files[5].text.contains("Rgb"), "{files:?}");
    assert_eq!(report.masks, 20);
}

#[test]
fn a_mask_with_object_and_surroundings_swapped_is_found() {
    let (folder, dataset) = made();
    edit(&folder, "004.png", |_, id| if id == 2 { 0 } else { 2 });
    let found = report(&folder, dataset).findings;
    let inverted: Vec<Finding> = found.into_iter().filter(|finding| finding.problem == Problem::Inverted).collect();
    assert_eq!(short(&inverted), [(Problem::Inverted, Some("004.png"), Some(2))]);
    // A single object, swapped in all masks.
    for view in dataset.all() {
        edit(&folder, &view.name, |_, id| u16::from(id != 1));
    }
    let found = report(&folder, dataset).findings;
    assert_eq!(found.len(), 24, "{found:?}");
    assert!(found.iter().all(|finding| finding.problem == Problem::Inverted && finding.id == Some(1)), "{found:?}");
}

#[test]
fn nearly_empty_masks_and_objects_are_found() {
    let (folder, dataset) = made();
    edit(&folder, "010.png", |_, _| 0);
    let found = report(&folder, dataset).findings;
    let empty: Vec<Finding> = found.into_iter().filter(|finding| finding.problem == Problem::NearlyEmpty).collect();
    assert_eq!(short(&empty), [(Problem::NearlyEmpty, Some("010.png"), None)]);

    // Masks of 600 px with 400 px of an id, except one mask with a single pixel of it.
    let id = |pixels: usize| {
        move |index: usize| match index {
            400.. => 5,
            _ if index < pixels => 4,
            _ => 0,
        }
    };
    let look = |pixels: usize| MaskStats::new(&map(30, 20, id(pixels)), &camera(30, 20), &[]);
    let (usual, speck) = (look(400), look(1));
    let masks = [("a", &usual), ("b", &usual), ("c", &speck), ("d", &usual), ("e", &usual)];
    assert_eq!(short(&findings(&masks)), [(Problem::NearlyEmpty, Some("c"), Some(4))]);
    let few = look(3);
    let masks = [("a", &usual), ("b", &usual), ("c", &few), ("d", &usual), ("e", &usual)];
    assert_eq!(findings(&masks), []);
}

/// Replaces all masks by the result of `change` on their ids.
fn replace(folder: &TempDir, change: impl Fn(&LabelMap) -> LabelMap) {
    for view in SYNTHETIC_SCENE.all() {
        let map = change(&view.mask().expect("read").expect("a mask"));
        let ids: Vec<u8> = map.ids.iter().map(|&id| id as u8).collect();
        write_png_grey8(folder.path().join("masks").join(&view.name), map.width, map.height, &ids).expect("written");
    }
}

/// Halves the size by a function of four pixels.
fn halved(map: &LabelMap, of: impl Fn([u16; 4]) -> u16) -> LabelMap {
    let pixel = |at: u32| {
        let (x, y) = (at % (MASK_WIDTH / 2) * 2, at / (MASK_WIDTH / 2) * 2);
        of([map.at(x, y), map.at(x + 1, y), map.at(x, y + 1), map.at(x + 1, y + 1)])
    };
    let ids = (0..MASK_WIDTH * MASK_HEIGHT / 4).map(pixel).collect();
    LabelMap { width: MASK_WIDTH / 2, height: MASK_HEIGHT / 2, ids }
}

#[test]
fn soft_masks_are_one_finding() {
    let (folder, dataset) = made();
    let mean = |four: [u16; 4]| (four.iter().sum::<u16>() + 2) / 4;
    let scaled =
        |by: u16| move |map: &LabelMap| LabelMap { ids: map.ids.iter().map(|id| id * by).collect(), ..map.clone() };
    let one =
        |map: &LabelMap| LabelMap { ids: map.ids.iter().map(|&id| u16::from(id == 1) * 255).collect(), ..map.clone() };
    let soft: [&dyn Fn(&LabelMap) -> LabelMap; 3] =
        [&|map| halved(map, mean), &|map| halved(&scaled(30)(map), mean), &|map| halved(&one(map), mean)];
    for (at, change) in soft.iter().enumerate() {
        replace(&folder, change);
        let found = report(&folder, dataset).findings;
        assert_eq!(short(&found), [(Problem::SoftEdges, None, None)], "{at}: {found:?}");
    }
    // Nearest-neighbour resizing preserves ids.
    for by in [1, 30] {
        replace(&folder, |map| halved(&scaled(by)(map), |four| four[0]));
        let found = report(&folder, dataset).findings;
        assert!(found.iter().all(|finding| finding.problem != Problem::SoftEdges), "{found:?}");
    }
}

#[test]
fn masks_of_nothing_and_of_everything_are_one_finding() {
    let (folder, dataset) = made();
    let filled = |id: u16| move |map: &LabelMap| LabelMap { ids: vec![id; map.ids.len()], ..map.clone() };
    for (id, problem) in [(0, Problem::NoObject), (255, Problem::OneArea)] {
        replace(&folder, filled(id));
        let found = report(&folder, dataset).findings;
        assert_eq!(short(&found), [(problem, None, None)]);
        assert!(found[0].text.contains(&format!("every pixel of all 24 masks is {id}")), "{found:?}");
    }
}

#[test]
fn masks_of_held_out_photos_only_are_found() {
    let (folder, dataset) = made();
    let mut dataset = dataset.clone();
    dataset.test = dataset.train.split_off(20);
    for view in &dataset.train {
        fs::remove_file(folder.path().join("masks").join(&view.name)).expect("removed");
    }
    let found = report(&folder, &dataset).findings;
    let held_out = found.iter().filter(|finding| finding.problem == Problem::HeldOut).count();
    assert_eq!(held_out, 1, "{found:?}");
}

#[test]
fn an_id_in_one_view_is_found() {
    let (folder, dataset) = made();
    edit(&folder, "012.png", |index, id| if index < 300 { 200 } else { id });
    assert_eq!(short(&report(&folder, dataset).findings), [(Problem::SingleView, Some("012.png"), Some(200))]);
}

#[test]
fn an_id_that_is_lost_for_one_view_is_found() {
    let (folder, dataset) = made();
    let mask = |name: &str| labelgs_masks::read_mask(folder.path().join("masks").join(name)).expect("a mask");
    let shown = |id: u16| {
        ["013.png", "014.png", "015.png"].iter().all(|name| {
            mask(name).ids.iter().filter(|&&found| found == id).count() * 100 > (MASK_WIDTH * MASK_HEIGHT) as usize
        })
    };
    let id = (1..=8).find(|&id| shown(id)).expect("an object in all three views");
    edit(&folder, "014.png", |_, found| if found == id { 0 } else { found });
    let found = report(&folder, dataset).findings;
    assert_eq!(short(&found), [(Problem::Blink, Some("014.png"), Some(u32::from(id)))]);
    assert!(found[0].text.contains("013.png and 015.png"), "{found:?}");
}

fn camera(width: u32, height: u32) -> Camera {
    Camera {
        rotation: DMat3::IDENTITY,
        translation: DVec3::ZERO,
        fx: 100.0,
        fy: 100.0,
        cx: f64::from(width) / 2.0,
        cy: f64::from(height) / 2.0,
        width,
        height,
    }
}

fn map(width: u32, height: u32, id: impl Fn(usize) -> u16) -> LabelMap {
    LabelMap { width, height, ids: (0..(width * height) as usize).map(id).collect() }
}

/// A missing id is not a finding if the object's points are outside the image or hidden in all three masks.
#[test]
fn points_excuse_an_absence() {
    // Points at depth 1 of a camera with a focal length of 100 px: 100 times their offset from the centre.
    let points: Vec<Point> = [[-0.05, 0.0, 1.0], [-0.06, 0.02, 1.0]]
        .map(|position| Point { position: glam::DVec3::from_array(position), colour: [0; 3] })
        .to_vec();
    let left = |inside: u16, outside: u16| map(20, 20, move |index| if index % 20 < 10 { inside } else { outside });
    let looks = |between: &LabelMap, between_camera: &Camera, points: &[Point]| {
        let shown = MaskStats::new(&left(3, 5), &camera(20, 20), points);
        let between = MaskStats::new(between, between_camera, points);
        findings(&[("a", &shown), ("b", &between), ("c", &shown)])
    };
    let here = camera(20, 20);
    let blink = [(Problem::Blink, Some("b"), Some(3))];
    assert_eq!(short(&looks(&left(0, 5), &here, &points)), blink);
    assert_eq!(short(&looks(&left(0, 5), &here, &[])), blink, "without points the missing id is a finding");
    let covered = map(20, 20, |index| if (2..8).contains(&(index % 20)) || index % 20 >= 10 { 5 } else { 0 });
    assert_eq!(looks(&covered, &here, &points), [], "behind another object");
    let away = Camera { translation: glam::DVec3::new(5.0, 0.0, 0.0), ..here.clone() };
    assert_eq!(looks(&left(0, 5), &away, &points), [], "out of the picture");
    let behind = Camera { translation: glam::DVec3::new(0.0, 0.0, -3.0), ..here.clone() };
    assert_eq!(looks(&left(0, 5), &behind, &points), [], "behind the camera");
    // Covered by an id that neighbouring views lack: another id for the same object.
    let found = looks(&left(9, 5), &here, &points);
    assert_eq!(short(&found), [(Problem::SingleView, Some("b"), Some(9)), (Problem::Blink, Some("b"), Some(3))]);
}

#[test]
fn pictures_of_one_pixel_and_one_line_are_measured() {
    for (width, height) in [(1, 1), (5, 1), (1, 5), (2, 2)] {
        let look = MaskStats::new(&map(width, height, |_| 1), &camera(width, height), &[]);
        let found = findings(&[("a", &look), ("b", &look)]);
        assert_eq!(short(&found), [(Problem::OneArea, None, None)], "{found:?}");
    }
    assert_eq!(findings(&[]), []);
}

#[test]
fn no_folder_is_an_error() {
    let scene = scene();
    let load = LoadOptions { photos: false, ..LoadOptions::default() };
    let dataset = scenes::open(scene.path(), &load).expect("a scene");
    assert!(super::fixtures::refusal(inspect(&dataset, Path::new("/no/such/folder"))).contains("no such folder"));
}
