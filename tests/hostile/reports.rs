//! Reported failures of other programs, one test each.

use crate::scenes::fixtures::{ColmapCamera, Scene, images_bin, pinhole, refusal, simple};
use labelgs::files::image::{photo_size, write_png_grey16};
use labelgs::files::read_photo;
use labelgs::formats::{read_model, write_model};
use labelgs::masks::read_mask;
use labelgs::scene::{Dataset, Gaussians};
use labelgs::scenes::{self, LoadOptions};

fn open(scene: &Scene) -> labelgs::Result<Dataset> {
    scenes::open(scene.path(), &LoadOptions { test_every: None, ..LoadOptions::default() })
}

/// Python's `L` has 4 bytes on Windows and 8 elsewhere; other readers took big-endian ids.
#[test]
fn colmap_fields_are_little_endian_and_of_fixed_width() {
    let scene = Scene::new();
    scene.photo("images/a.png", 12, 8);
    let (camera, image, point) = (0x0102_0304_u32, 0x0506_0708_u32, 0x1112_1314_1516_1718_u64);
    let mut cameras = 1u64.to_le_bytes().to_vec();
    cameras.extend([camera, 1].map(u32::to_le_bytes).concat());
    cameras.extend([12u64, 8].map(u64::to_le_bytes).concat());
    [10.0, 11.0, 5.5, 4.5_f64].iter().for_each(|value| cameras.extend(value.to_le_bytes()));
    let mut images = images_bin(&["a.png"], 1);
    images[8..12].copy_from_slice(&image.to_le_bytes());
    images[12 + 56..12 + 60].copy_from_slice(&camera.to_le_bytes());
    let mut points = 1u64.to_le_bytes().to_vec();
    points.extend(point.to_le_bytes());
    [1.0, 2.0, 3.0_f64].iter().for_each(|value| points.extend(value.to_le_bytes()));
    points.extend([9, 8, 7]);
    points.extend(0.5_f64.to_le_bytes());
    points.extend(1u64.to_le_bytes());
    points.extend([image, 3].map(u32::to_le_bytes).concat());
    for (name, bytes) in [("cameras", &cameras), ("images", &images), ("points3D", &points)] {
        scene.write(&format!("sparse/0/{name}.bin"), bytes);
    }
    let dataset = open(&scene).expect("a scene");
    assert_eq!((dataset.train[0].camera.fx, dataset.train[0].camera.width), (10.0, 12));
    assert_eq!((dataset.points[0].position.to_array(), dataset.points[0].colour), ([1.0, 2.0, 3.0], [9, 8, 7]));
    // The same ids in big-endian name another camera.
    images[12 + 56..12 + 60].copy_from_slice(&camera.to_be_bytes());
    scene.write("sparse/0/images.bin", &images);
    assert!(refusal(open(&scene)).contains(&camera.swap_bytes().to_string()));
}

#[test]
fn colmap_names_with_spaces_are_whole() {
    let names = ["my photo 1.png", "a folder/b  c.png"];
    for text in [false, true] {
        let scene = Scene::new();
        if text {
            scene.colmap_txt("sparse/0", &[pinhole()], &names);
        } else {
            scene.colmap_bin("sparse/0", &[pinhole()], &names);
        }
        names.iter().for_each(|name| scene.photo(&format!("images/{name}"), 12, 8));
        let dataset = open(&scene).expect("a scene");
        let found: Vec<&str> = dataset.train.iter().map(|view| view.name.as_str()).collect();
        assert_eq!(found, ["a folder/b  c.png", "my photo 1.png"]);
    }
}

#[test]
fn an_unknown_camera_model_names_those_that_are_known() {
    let scene = simple(1);
    scene.colmap_bin("sparse/0", &[ColmapCamera { model: 77, ..pinhole() }], &["00.png"]);
    let text = refusal(open(&scene));
    let parts = ["cameras.bin", "camera 1", "77", "OPENCV_FISHEYE", "PINHOLE"];
    assert!(parts.iter().all(|part| text.contains(part)), "{text}");
}

/// Half of 1039 x 693 is 519.5 x 346.5, which programs round up, down, and to even.
#[test]
fn a_photo_a_pixel_off_its_camera_is_used() {
    for (width, height) in [(519, 346), (520, 347), (519, 347), (520, 346)] {
        let scene = Scene::new();
        let parameters = vec![900.0, 900.0, 519.5, 346.5];
        scene.colmap_bin("sparse/0", &[ColmapCamera { size: (1039, 693), parameters, ..pinhole() }], &["a.png"]);
        scene.photo("images/a.png", width, height);
        write_png_grey16(scene.at("masks/a.png"), 519, 346, &vec![7; 519 * 346]).expect("a mask");
        let masks = Some(scene.path().join("masks"));
        let options = LoadOptions { masks, test_every: None, ..LoadOptions::default() };
        let dataset = scenes::open(scene.path(), &options).expect("a scene");
        let view = &dataset.train[0];
        let (camera, mask) = (&view.camera, view.mask().expect("read").expect("a mask"));
        assert_eq!((camera.width, camera.height, mask.width, mask.height), (width, height, width, height));
        assert!((camera.fx - 900.0 * f64::from(width) / 1039.0).abs() < 1e-9);
        assert!(mask.ids.iter().all(|&id| id == 7));
    }
}

#[test]
fn more_than_255_ids_stay_apart() {
    let scene = simple(1);
    let ids: Vec<u16> = (0..96).map(|index| index * 677).collect();
    write_png_grey16(scene.at("masks/00.png"), 12, 8, &ids).expect("a mask");
    assert_eq!(read_mask(scene.at("masks/00.png")).expect("a mask").ids, ids);
    let masks = Some(scene.path().join("masks"));
    let dataset = scenes::open(scene.path(), &LoadOptions { masks, test_every: None, ..LoadOptions::default() });
    let dataset = dataset.expect("a scene");
    assert_eq!(dataset.train[0].mask.as_ref().expect("a mask").objects().len(), 95);
}

/// Poses belong to the stored pixels: a tag that asks viewers to turn the photo changes nothing.
#[test]
fn an_exif_orientation_turns_nothing() {
    let scene = simple(1);
    let turned = super::seeds::photo_jpeg().pop().expect("the photo with a tag");
    assert!(turned.windows(4).any(|part| part == b"Exif"), "the photo has the tag");
    let path = scene.write("images/00.png", &turned);
    assert_eq!(photo_size(&path).expect("a size"), (12, 8));
    let photo = read_photo(&path, [0.0; 3]).expect("a photo");
    assert_eq!((photo.width, photo.height), (12, 8));
    // Red grows to the right in the stored pixels, green downwards.
    let at = |x: usize, y: usize| photo.rgba[y * 12 + x];
    assert!(at(11, 0)[0] > at(0, 0)[0] + 100 && at(0, 7)[1] > at(0, 0)[1] + 100, "{:?} {:?}", at(11, 0), at(0, 7));
    assert_eq!(open(&scene).expect("a scene").train[0].camera.width, 12);
}

#[test]
fn a_cmyk_photo_has_the_colours_that_were_meant() {
    let scene = Scene::new();
    let [.., cmyk, _] = &super::seeds::photo_jpeg()[..] else { panic!("the seeds have a CMYK photo") };
    let photo = read_photo(scene.write("a.jpg", cmyk), [0.0; 3]).expect("a photo");
    // It was made of red 20 x, green 30 y and blue 90.
    for (x, y) in [(2, 2), (9, 2), (2, 6), (9, 6)] {
        let [r, g, b, _] = photo.rgba[y * 12 + x];
        let near = |found: u8, meant: usize| usize::from(found).abs_diff(meant) < 40;
        assert!(near(r, 20 * x) && near(g, 30 * y) && near(b, 90), "({x}, {y}): {r} {g} {b}");
    }
}

fn model(count: usize, degree: u32) -> Gaussians {
    let mut g = Gaussians { sh_degree: degree, ..Gaussians::default() };
    let rest = g.rest_per_gaussian();
    for row in 0..count {
        let value = row as f32;
        g.means.push([value, 0.5, -value]);
        g.quats.push([1.0, 0.0, 0.1, value]);
        g.scales.push([-value - 0.1, -3.0, -2.0]);
        g.opacities.push(value - 3.0);
        g.sh0.push([value; 3]);
        g.sh_rest.extend((0..rest).map(|k| [value + k as f32, -value, 0.25]));
    }
    g.labels = Some((0..count as u32).collect());
    g.label_confidence = Some(vec![0.5; count]);
    g
}

/// A filter that forgot the harmonics once moved all later rows into each other.
#[test]
fn a_bad_row_takes_all_of_its_attributes_along() {
    let scene = Scene::new();
    for degree in 0..=3 {
        let clean = model(9, degree);
        let rest = clean.rest_per_gaussian();
        type Poison = fn(&mut Gaussians, usize, f32);
        let poisons: [(&str, Poison); 6] = [
            ("mean", |g, _, bad| g.means[4][1] = bad),
            ("rotation", |g, _, bad| g.quats[4][2] = bad),
            ("scale", |g, _, bad| g.scales[4][0] = bad),
            ("opacity", |g, _, bad| g.opacities[4] = bad),
            ("constant", |g, _, bad| g.sh0[4][2] = bad),
            ("harmonic", |g, rest, bad| {
                if rest > 0 {
                    g.sh_rest[4 * rest + rest - 1][2] = bad;
                } else {
                    g.sh0[4][0] = bad;
                }
            }),
        ];
        for (what, poison) in poisons {
            for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
                let mut bytes = clean.clone();
                poison(&mut bytes, rest, bad);
                let path = scene.at("a.ply");
                assert_eq!(write_model(&path, &bytes).expect("written"), 1, "{what}");
                let read = read_model(&path).expect("read");
                assert_eq!(read.gaussians, clean.filtered(|row| row != 4), "{what} {bad}, degree {degree}");
            }
        }
    }
}

/// A PLY with scales after their exponential made a laptop shut down.
#[test]
fn values_that_were_activated_twice_are_pointed_out() {
    let scene = Scene::new();
    let path = scene.at("a.ply");
    let raw = model(20, 0);
    write_model(&path, &raw).expect("written");
    assert_eq!(read_model(&path).expect("read").notes, Vec::<String>::new());
    let mut activated = raw.clone();
    activated.opacities.iter_mut().for_each(|value| *value = 1.0 / (1.0 + (-*value).exp()));
    activated.scales.iter_mut().flatten().for_each(|value| *value = value.exp());
    write_model(&path, &activated).expect("written");
    let read = read_model(&path).expect("read");
    assert!(read.notes.len() == 1 && read.notes[0].contains("after their sigmoid and exponential"), "{:?}", read.notes);
    // Sizes whose square overflows f32 are always dropped.
    let mut huge = raw.clone();
    huge.scales[3] = [45.0, 0.0, 0.0];
    huge.scales[5] = [0.0, 1e30, 0.0];
    huge.opacities[6] = 1e30;
    huge.opacities[7] = -1e30;
    write_model(&path, &huge).expect("written");
    let read = read_model(&path).expect("read");
    assert_eq!((read.dropped, read.gaussians.len()), (2, 18));
    assert!(read.notes[0].contains("2 with an infinite size"), "{:?}", read.notes);
}
