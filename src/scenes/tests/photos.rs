//! Photos: decoding, sizes, averaging, undistortion.

use super::all;
use super::fixtures::*;
use glam::DVec2;
use labelgs_files::image::{photo_size, write_png_grey16};
use labelgs_files::read_photo;
use labelgs_scene::Error;
use labelgs_scene::{Dataset, Photo};
use labelgs_scenes::lens::{Lens, Polynomial, Projection};
use labelgs_scenes::{self as scenes, LoadOptions};
use std::fs;

fn open(scene: &Scene, max_resolution: Option<u32>) -> labelgs_scene::Result<Dataset> {
    scenes::open(scene.path(), &LoadOptions { max_resolution, ..all() })
}

#[test]
fn every_kind_of_photo_becomes_rgb() {
    let scene = Scene::new();
    let grey = image::GrayImage::from_pixel(3, 2, image::Luma([77]));
    grey.save(scene.at("grey.png")).expect("a photo");
    grey.save_with_format(scene.at("wrong.png"), image::ImageFormat::Jpeg).expect("a photo");
    let wide: image::ImageBuffer<image::Rgb<u16>, Vec<u16>> =
        image::ImageBuffer::from_pixel(3, 2, image::Rgb([65535, 257, 0]));
    wide.save(scene.at("wide.png")).expect("a photo");
    let read = |name: &str| read_photo(scene.at(name), [0.0; 3]).expect("a photo").rgba[0];
    assert_eq!(read("grey.png"), [77, 77, 77, 255]);
    assert_eq!(read("wrong.png"), [77, 77, 77, 255]);
    assert_eq!(read("wide.png"), [255, 1, 0, 255]);
    assert_eq!(photo_size(scene.at("grey.png")).expect("a size"), (3, 2));
}

#[test]
fn undecodable_photos_are_listed_together() {
    let scene = simple(5);
    scene.write("images/01.png", b"");
    let whole = fs::read(scene.path().join("images/03.png")).expect("bytes");
    scene.write("images/03.png", &whole[..whole.len() / 2]);
    let text = refusal(open(&scene, None));
    assert!(text.contains("2 of 5") && text.contains("01.png") && text.contains("03.png"), "{text}");
}

#[test]
fn a_scaled_photo_scales_its_camera_and_another_shape_is_refused() {
    let scene = simple(1);
    scene.photo("images/00.png", 24, 16);
    let dataset = open(&scene, None).expect("a scene");
    let camera = &dataset.train[0].camera;
    assert_eq!((camera.fx, camera.fy, camera.cx, camera.cy, camera.width), (20.0, 22.0, 11.0, 9.0, 24));
    // 8 rows of 12 scaled to 25 px would be 16.7 rows: 16 and 17 are both within 1 px.
    scene.photo("images/00.png", 25, 16);
    assert_eq!(open(&scene, None).expect("a scene").train[0].camera.height, 16);
    scene.photo("images/00.png", 8, 12);
    let text = refusal(open(&scene, None));
    assert!(text.contains("8 x 12") && text.contains("EXIF"), "{text}");
}

#[test]
fn the_longest_side_is_bounded_by_one_rounding_rule() {
    for ((width, height), bound, expected) in
        [((1039, 693), 520, (520, 347)), ((1060, 707), 530, (530, 354)), ((7, 1), 3, (3, 1)), ((9, 5), 20, (9, 5))]
    {
        let scene = Scene::new();
        let parameters = vec![100.0, 100.0, f64::from(width) / 2.0, f64::from(height) / 2.0];
        let camera = ColmapCamera { size: (u64::from(width), u64::from(height)), parameters, ..pinhole() };
        scene.colmap_bin("sparse/0", &[camera], &["a.png"]);
        scene.photo("images/a.png", width, height);
        let dataset = open(&scene, Some(bound)).expect("a scene");
        let (camera, photo) = (&dataset.train[0].camera, dataset.train[0].photo().expect("a photo"));
        assert_eq!((camera.width, camera.height), expected);
        assert_eq!((photo.width, photo.height), expected);
        assert_eq!(photo.rgba.len() as u32, expected.0 * expected.1);
    }
    let none = LoadOptions { max_resolution: Some(0), ..LoadOptions::default() };
    assert!(matches!(scenes::open(simple(1).path(), &none).expect_err("no image"), Error::Usage { .. }));
}

/// Mean of `photo` over the box of target pixel (x, y), by brute force on a grid of 1/60 px.
fn box_mean(photo: &Photo, x: u32, y: u32, (width, height): (u32, u32)) -> [f64; 3] {
    let (sx, sy) = (f64::from(photo.width) / f64::from(width), f64::from(photo.height) / f64::from(height));
    let mut sum = [0.0; 3];
    let cells = 300;
    for i in 0..cells {
        for j in 0..cells {
            let at = |index: u32, cell: u32, scale: f64| {
                ((f64::from(index) + (f64::from(cell) + 0.5) / f64::from(cells)) * scale) as u32
            };
            let texel = photo.rgba[(at(y, j, sy) * photo.width + at(x, i, sx)) as usize];
            (0..3).for_each(|channel| sum[channel] += f64::from(texel[channel]));
        }
    }
    sum.map(|value| value / f64::from(cells * cells))
}

#[test]
fn shrinking_averages_the_exact_box() {
    let scene = simple(1);
    let full = read_photo(scene.path().join("images/00.png"), [0.0; 3]).expect("a photo");
    for bound in [11, 7, 5, 1] {
        let dataset = open(&scene, Some(bound)).expect("a scene");
        let photo = dataset.train[0].photo().expect("a photo");
        for y in 0..photo.height {
            for x in 0..photo.width {
                let expected = box_mean(&full, x, y, (photo.width, photo.height));
                let texel = photo.rgba[(y * photo.width + x) as usize];
                assert!((0..3).all(|c| (f64::from(texel[c]) - expected[c]).abs() < 0.75), "{texel:?} {expected:?}");
                assert_eq!(texel[3], 255);
            }
        }
    }
}

#[test]
fn distortion_equals_opencv() {
    let at = DVec2::new(0.3, -0.2);
    let lens = Polynomial {
        numerator: [0.1, -0.05, 0.02, 0.0],
        denominator: [0.01, 0.02, 0.03],
        tangential: [0.004, -0.003],
        ..Polynomial::default()
    };
    let (x, y, r2) = (at.x, at.y, at.x * at.x + at.y * at.y);
    let radial = (1.0 + 0.1 * r2 - 0.05 * r2.powi(2) + 0.02 * r2.powi(3))
        / (1.0 + 0.01 * r2 + 0.02 * r2.powi(2) + 0.03 * r2.powi(3));
    let expected = DVec2::new(
        x * radial + 2.0 * 0.004 * x * y - 0.003 * (r2 + 2.0 * x * x),
        y * radial + 0.004 * (r2 + 2.0 * y * y) - 2.0 * 0.003 * x * y,
    );
    assert!(lens.distort(at).distance(expected) < 1e-15);
    assert_eq!(Polynomial::default().distort(at), at);
    assert!(Lens::from(Polynomial::default()).is_pinhole() && !Lens::from(lens).is_pinhole());
    // r (1 - r^2) has its maximum at r = 1 / sqrt 3.
    let folded = Polynomial { numerator: [-1.0, 0.0, 0.0, 0.0], ..Polynomial::default() };
    assert!((folded.reach().tan() - 3f64.powf(-0.5)).abs() < 2e-3);
}

/// A scene photographed through an OPENCV lens; the photo's colours encode its own pixel coordinates.
fn distorted(k: [f64; 4], size: (u32, u32)) -> Scene {
    let scene = Scene::new();
    let (w, h) = (f64::from(size.0), f64::from(size.1));
    let parameters = [vec![0.9 * w, 0.95 * w, 0.52 * w, 0.47 * h], k.to_vec()].concat();
    let camera = ColmapCamera { model: 4, name: "OPENCV", size: (u64::from(size.0), u64::from(size.1)), parameters };
    scene.colmap_bin("sparse/0", &[camera], &["a.png"]);
    image::RgbImage::from_fn(size.0, size.1, |x, y| image::Rgb([x as u8, y as u8, 200]))
        .save(scene.at("images/a.png"))
        .expect("a photo");
    scene
}

#[test]
fn undistortion_samples_where_the_model_says() {
    let size = (200, 150);
    for k in [[0.08, -0.03, 0.002, -0.001], [-0.25, 0.05, 0.0, 0.0]] {
        let scene = distorted(k, size);
        let ids: Vec<u16> = (0..size.1).flat_map(|y| (0..size.0).map(move |x| (y * size.0 + x + 1) as u16)).collect();
        write_png_grey16(scene.at("masks/a.png"), size.0, size.1, &ids).expect("written");
        let masks = Some(scene.path().join("masks"));
        let dataset = scenes::open(scene.path(), &LoadOptions { masks, ..all() }).expect("a scene");
        let view = &dataset.train[0];
        let (camera, photo) = (&view.camera, view.photo().expect("a photo"));
        let mask = view.mask().expect("read").expect("a mask");
        let lens = Polynomial {
            numerator: [k[0], k[1], 0.0, 0.0],
            denominator: [0.0; 3],
            tangential: [k[2], k[3]],
            ..Polynomial::default()
        };
        let (mut inside, mut outside) = (0, 0);
        for y in 0..size.1 {
            for x in 0..size.0 {
                let ideal = DVec2::new(
                    (f64::from(x) + 0.5 - camera.cx) / camera.fx,
                    (f64::from(y) + 0.5 - camera.cy) / camera.fy,
                );
                let bent = lens.distort(ideal);
                let at = DVec2::new(bent.x * camera.fx + camera.cx, bent.y * camera.fy + camera.cy);
                let texel = photo.rgba[(y * size.0 + x) as usize];
                if at.x < 0.0 || at.y < 0.0 || at.x >= f64::from(size.0) || at.y >= f64::from(size.1) {
                    outside += 1;
                    assert_eq!((texel, mask.at(x, y)), ([0; 4], 0));
                    continue;
                }
                inside += 1;
                assert_eq!(texel[3], 255);
                // A colour of n is the pixel with its centre at n + 0.5; border pixels have no neighbour.
                let expected = (at - 0.5).clamp(DVec2::ZERO, DVec2::new(f64::from(size.0 - 1), f64::from(size.1 - 1)));
                assert!((f64::from(texel[0]) - expected.x).abs() <= 0.51, "{x} {y}: {texel:?} {expected}");
                assert!((f64::from(texel[1]) - expected.y).abs() <= 0.51, "{x} {y}: {texel:?} {expected}");
                assert_eq!(u32::from(mask.at(x, y)), at.y as u32 * size.0 + at.x as u32 + 1);
            }
        }
        assert!(inside > 25_000 && (outside > 0) == (k[0] > 0.0), "{inside} {outside}");
    }
}

#[test]
fn pixels_without_source_stay_out_when_shrunk() {
    let scene = distorted([0.3, 0.0, 0.0, 0.0], (200, 150));
    let dataset = open(&scene, Some(50)).expect("a scene");
    let photo = dataset.train[0].photo().expect("a photo");
    let alphas: Vec<u8> = photo.rgba.iter().map(|texel| texel[3]).collect();
    assert_eq!((alphas[0], alphas[25 * 50 / 2 + 18 * 50]), (0, 255));
    // No black from missing sources is mixed into the colours: blue is 200 wherever it is non-zero.
    assert!(photo.rgba.iter().all(|texel| texel[3] == 0 || texel[2] == 200));
}
