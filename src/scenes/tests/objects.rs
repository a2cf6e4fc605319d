//! Photos of isolated objects: opacity, edge colours, and what is read or omitted.

use super::fixtures::{Scene, simple};
use super::{noted, open as open_plain};
use labelgs_scene::view::{ALPHA_CLEAR, alpha_of};
use labelgs_scene::{Dataset, LabelMap, Photo, Result};
use labelgs_scenes::LoadOptions;
use labelgs_scenes::matte::cut_out;

const PHOTO_WIDTH: usize = 480;
const PHOTO_HEIGHT: usize = 60;
const WALL_COLOUR: [f64; 3] = [250.0, 245.0, 240.0];

/// A photo with a vertical edge: an object colour to the left of column `edge`, a wall to the right, mixed in
/// proportion within the edge's pixel. The mask ends at column `contour`.
fn upright(object: [f64; 3], edge: f64, contour: usize) -> (Photo, LabelMap) {
    let texel = |at: usize| {
        let share = (edge - (at % PHOTO_WIDTH) as f64).clamp(0.0, 1.0);
        let [r, g, b] = [0, 1, 2].map(|c| (object[c] * share + WALL_COLOUR[c] * (1.0 - share)).round() as u8);
        [r, g, b, 255]
    };
    let (width, height) = (PHOTO_WIDTH as u32, PHOTO_HEIGHT as u32);
    let ids = (0..PHOTO_WIDTH * PHOTO_HEIGHT).map(|at| u16::from(at % PHOTO_WIDTH < contour) * 3).collect();
    (
        Photo { width, height, rgba: (0..PHOTO_WIDTH * PHOTO_HEIGHT).map(texel).collect() },
        LabelMap { width, height, ids },
    )
}

fn column(photo: &Photo, x: usize) -> [u8; 4] {
    photo.rgba[PHOTO_HEIGHT / 2 * PHOTO_WIDTH + x]
}

/// The contour is one pixel too far out: the wall there does not belong to the object, and the mixed pixel gets the
/// opacity and colour of the object.
#[test]
fn an_edge_has_the_colour_of_its_object_alone() {
    let object = [120.0, 60.0, 20.0];
    let (mut photo, mask) = upright(object, 100.4, 101);
    cut_out(&mut photo, &mask);
    assert_eq!(column(&photo, 90), [120, 60, 20, 255]);
    assert_eq!(column(&photo, 110), [0, 0, 0, ALPHA_CLEAR]);
    let [r, g, b, alpha] = column(&photo, 100);
    // The weight that the colours lack goes to the distance from the contour.
    assert!(alpha.abs_diff(alpha_of(0.4)) <= 8, "{alpha}");
    let opacity = f64::from(alpha - ALPHA_CLEAR) / 127.0;
    for (own, of) in [r, g, b].into_iter().zip(object) {
        assert!((f64::from(own) - opacity * of).abs() < 25.0, "{r} {g} {b} of {opacity}");
    }
    let outside = column(&photo, 101);
    assert!(
        outside[3] < alpha_of(0.12) && outside[..3].iter().all(|&value| value < 32),
        "the wall has gone: {outside:?}"
    );
}

/// An object as bright as its wall: only the contour decides, and opacity falls off across it.
#[test]
fn alike_colours_leave_the_edge_to_the_contour() {
    let (mut photo, mask) = upright(WALL_COLOUR, 100.0, 100);
    cut_out(&mut photo, &mask);
    let shares: Vec<u8> = (96..104).map(|x| column(&photo, x)[3]).collect();
    assert!(shares.is_sorted_by(|a, b| a >= b) && shares[0] == 255 && shares[7] == ALPHA_CLEAR, "{shares:?}");
    assert!(shares.iter().any(|&share| (140..240).contains(&share)), "no soft edge: {shares:?}");
    for x in 96..104 {
        let [r, .., alpha] = column(&photo, x);
        let expected = WALL_COLOUR[0] * f64::from(alpha - ALPHA_CLEAR) / 127.0;
        assert!((f64::from(r) - expected).abs() <= 2.0, "{r} at {x}, not {expected}");
    }
}

/// Invalid and previously transparent pixels stay so; a mask of another size is scaled.
#[test]
fn what_was_clear_before_stays_clear() {
    let (mut photo, mask) = upright([10.0; 3], 100.0, 100);
    photo.rgba[0] = [0; 4];
    photo.rgba[1] = [5, 5, 5, alpha_of(0.5)];
    let small = mask.resized(PHOTO_WIDTH as u32 / 2, PHOTO_HEIGHT as u32 / 2);
    cut_out(&mut photo, &small);
    assert_eq!(photo.rgba[..2], [[0; 4], [5, 5, 5, alpha_of(0.5)]]);
    assert_eq!((column(&photo, 50), column(&photo, 200)), ([10, 10, 10, 255], [0, 0, 0, ALPHA_CLEAR]));
}

fn open(scene: &Scene, options: LoadOptions) -> Result<Dataset> {
    let masks = Some(scene.path().join("masks"));
    labelgs_scenes::open(scene.path(), &LoadOptions { masks, masked_only: true, ..options })
}

/// Training photos are cropped to their objects together with their cameras, held-out ones stay whole, and those
/// without an object are omitted with a note. Photos that do not fit into memory have the same pixels.
#[test]
fn photos_are_cut_to_their_objects() {
    let scene = simple(0);
    let names = ["00.png", "01.png", "02.png", "03.png"];
    let camera = super::fixtures::ColmapCamera {
        model: 1,
        name: "PINHOLE",
        size: (60, 40),
        parameters: vec![50.0, 50.0, 30.0, 20.0],
    };
    scene.colmap_bin("sparse/0", &[camera], &names);
    names.iter().for_each(|name| scene.photo(&format!("images/{name}"), 60, 40));
    let mask = |name: &str, id: u8| {
        let inside = |x: u32, y: u32| if (30..40).contains(&x) && (10..22).contains(&y) { id } else { 0 };
        let picture = image::GrayImage::from_fn(60, 40, |x, y| image::Luma([inside(x, y)]));
        picture.save(scene.at(&format!("masks/{name}"))).expect("a mask");
    };
    ["00.png", "01.png", "03.png"].into_iter().for_each(|name| mask(name, 5));
    mask("02.png", 0);
    let options = LoadOptions { test_every: Some(4), cut: true, ..LoadOptions::default() };
    let dataset = open(&scene, options.clone()).expect("a scene");
    assert_eq!(super::names(&dataset.train), ["01.png", "03.png"]);
    noted(&dataset.notes, &["02.png", "without the mask of an object"]);
    let (whole, part) = (&dataset.test[0], &dataset.train[0]);
    assert_eq!((whole.camera.size(), part.camera.size()), ((60, 40), (26, 28)));
    // 8 px around the object.
    assert_eq!((part.camera.cx, part.camera.cy), (30.0 - 22.0, 20.0 - 2.0));
    let (photo, ids) = (part.photo().expect("a photo"), part.mask().expect("read").expect("a mask"));
    assert_eq!((photo.rgba.len(), ids.width, ids.bounds()), (26 * 28, 26, Some([8, 8, 18, 20])));
    let plain = open_plain(&scene).expect("a scene");
    let stored = plain.train[1].photo().expect("a photo");
    assert_eq!(photo.rgba[14 * 26 + 13], stored.rgba[16 * 60 + 35]);
    assert_eq!(photo.rgba[0], [0, 0, 0, ALPHA_CLEAR]);
    let uncut = open(&scene, LoadOptions { cut: false, ..options.clone() }).expect("a scene");
    assert_eq!(uncut.train[0].camera.size(), (60, 40));
    for photo_folder in [None, Some(scene.path().to_owned())] {
        let few = open(&scene, LoadOptions { photo_memory: 1, photo_folder, ..options.clone() }).expect("a scene");
        assert!(!few.train[0].photo.as_ref().expect("a photo").is_held());
        assert_eq!(few.train[0].photo().expect("a photo"), photo);
        assert_eq!(few.train[0].mask().expect("read").expect("a mask"), ids);
    }
}

#[test]
fn objects_alone_need_masks() {
    let scene = simple(2);
    let options = LoadOptions { masked_only: true, ..LoadOptions::default() };
    let error = labelgs_scenes::open(scene.path(), &options).expect_err("no masks").to_string();
    assert!(error.contains("masked_only") && error.contains("masks"), "{error}");
}
