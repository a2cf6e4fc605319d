//! Depth maps from all supported file types, matched to their photos.

use super::all;
use super::fixtures::{ColmapCamera, Scene, refusal, simple};
use labelgs_files as files;
use labelgs_scene::{Dataset, DepthMap, View};
use labelgs_scenes::{self as scenes, DepthFolder, LoadOptions, Lookup};
use std::path::Path;

const PHOTO_SIZE: (u32, u32) = (12, 8);

/// A number per pixel that 16-bit integers, float16 and float32 all represent exactly.
fn value(index: usize) -> f32 {
    (index * 3 + 1) as f32
}

fn values() -> Vec<f32> {
    (0..96).map(value).collect()
}

fn open(scene: &Scene, max_resolution: Option<u32>) -> Dataset {
    let options = LoadOptions { max_resolution, photos: false, ..all() };
    scenes::open(scene.path(), &options).expect("a scene")
}

fn folder(scene: &Scene) -> labelgs_scene::Result<DepthFolder> {
    DepthFolder::open(&scene.path().join("depths"), scene.path(), &Lookup::default())
}

fn read(scene: &Scene) -> labelgs_scene::Result<DepthMap> {
    let dataset = open(scene, None);
    folder(scene)?.read(&dataset.train[0])
}

pub fn npy(descr: &str, order: &str, shape: &str, data: &[u8]) -> Vec<u8> {
    let mut header = format!("{{'descr': '{descr}', 'fortran_order': {order}, 'shape': {shape}, }}");
    while (header.len() + 11) % 64 != 0 {
        header.push(' ');
    }
    header.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(data);
    bytes
}

fn pfm(scale: &str, float: fn(f32) -> [u8; 4]) -> Vec<u8> {
    let mut bytes = format!("Pf\n12 8\n{scale}\n").into_bytes();
    for row in (0..8).rev() {
        (0..12).for_each(|x| bytes.extend(float(value(row * 12 + x))));
    }
    bytes
}

fn png(path: &Path, depth: png::BitDepth, colour: png::ColorType, bytes: &[u8]) {
    let mut encoder = png::Encoder::new(std::fs::File::create(path).expect("a file"), PHOTO_SIZE.0, PHOTO_SIZE.1);
    encoder.set_color(colour);
    encoder.set_depth(depth);
    encoder.write_header().expect("a header").write_image_data(bytes).expect("pixels");
}

fn words() -> Vec<u8> {
    values().iter().flat_map(|&v| (v as u16).to_be_bytes()).collect()
}

/// A depth file to be read back bit by bit.
#[track_caller]
fn comes_back(name: &str, write: impl FnOnce(&Path)) {
    let scene = simple(1);
    write(&scene.at(&format!("depths/{name}")));
    let found = read(&scene).unwrap_or_else(|error| panic!("{name}: {error}"));
    assert_eq!((found.width, found.height, found.values), (12, 8, values()), "{name}");
}

#[test]
fn every_kind_of_file_comes_back_exactly() {
    let bytes = |float: fn(f32) -> Vec<u8>| values().into_iter().flat_map(float).collect::<Vec<u8>>();
    let file = |bytes: Vec<u8>| move |path: &Path| std::fs::write(path, bytes).expect("written");
    comes_back("00.npy", file(npy("<f4", "False", "(8, 12)", &bytes(|v| v.to_le_bytes().to_vec()))));
    comes_back("00.npy", file(npy(">f4", "False", "(8, 12)", &bytes(|v| v.to_be_bytes().to_vec()))));
    comes_back("00.npy", file(npy("<f8", "False", "(8, 12)", &bytes(|v| f64::from(v).to_le_bytes().to_vec()))));
    let half = |v: f32| half::f16::from_f32(v).to_le_bytes().to_vec();
    comes_back("00.png.npy", file(npy("<f2", "False", "(8, 12)", &bytes(half))));
    comes_back("00.pfm", file(pfm("-1.0", f32::to_le_bytes)));
    comes_back("00.PFM".to_lowercase().as_str(), file(pfm("1", f32::to_be_bytes)));
    comes_back("00.exr", |path| files::image::write_exr_y(path, 12, 8, &values()).expect("written"));
    let grey: Vec<[f32; 3]> = values().iter().map(|&v| [v, 0.0, -v]).collect();
    comes_back("00.exr", |path| files::image::write_exr_rgb(path, 12, 8, &grey).expect("written"));
    comes_back("00.png", |path| png(path, png::BitDepth::Sixteen, png::ColorType::Grayscale, &words()));
    // An image of the depth beside the depth is not read.
    comes_back("00.exr", |path| {
        files::image::write_exr_y(path, 12, 8, &values()).expect("written");
        std::fs::write(path.with_extension("png"), b"a picture").expect("written");
    });
}

#[test]
fn broken_files_are_refused_with_their_fault() {
    let floats = |count: usize| (0..count).flat_map(|i| value(i).to_le_bytes()).collect::<Vec<u8>>();
    let cases: Vec<(&str, Vec<u8>, &str)> = vec![
        ("00.npy", b"not numpy".to_vec(), "NPY"),
        ("00.npy", npy("<f4", "False", "(8, 12)", &floats(95)), "NPY"),
        ("00.npy", npy("<f4", "True", "(8, 12)", &floats(96)), "ascontiguousarray"),
        ("00.npy", npy("<f4", "False", "(1, 8, 12)", &floats(96)), "(height, width)"),
        ("00.npy", npy("<f4", "False", "(8, 1.5)", &floats(96)), "whole numbers"),
        ("00.npy", npy("<i4", "False", "(8, 12)", &floats(96)), "float16, float32 or float64"),
        ("00.npy", npy("<f4", "False", "(90000, 90000)", &floats(96)), "90000 x 90000"),
        ("00.npy", npy("<f4", "False", "(12, 12)", &floats(144)), "12 x 12 px and its photo 12 x 8"),
        ("00.npy", npy("<f4", "False", "(8, 12)", &[0xff; 384]), "no finite depth"),
        ("00.pfm", b"P5\n12 8\n255\n".to_vec(), "does not start with"),
        ("00.pfm", b"PF\n12 8\n-1\n".to_vec(), "colour PFM"),
        ("00.pfm", b"Pf\n12 x\n-1\n".to_vec(), "no height"),
        ("00.pfm", b"Pf\n12 8\n-1\nshort".to_vec(), "need 384 bytes, it has 5"),
        ("00.pfm", b"Pf\n-12 8\n-1\n".to_vec(), "0 x 8"),
        ("00.pfm", b"".to_vec(), "does not start with"),
        ("00.exr", b"no picture".to_vec(), "EXR"),
        ("00.exr", b"".to_vec(), "EXR"),
        ("00.png", b"no picture".to_vec(), "PNG"),
    ];
    for (name, bytes, problem) in cases {
        let scene = simple(1);
        scene.write(&format!("depths/{name}"), bytes);
        let message = refusal(read(&scene));
        assert!(message.contains(problem) && message.contains("00."), "{name}: {message}");
    }
    let scene = simple(1);
    let path = scene.at("depths/00.png");
    png(&path, png::BitDepth::Eight, png::ColorType::Grayscale, &[9; 96]);
    assert!(refusal(read(&scene)).contains("16-bit grey"));
    png(&path, png::BitDepth::Sixteen, png::ColorType::Rgb, &[9; 96 * 6]);
    assert!(refusal(read(&scene)).contains("16-bit grey"));
}

#[test]
fn a_folder_must_have_all_maps() {
    let scene = simple(3);
    let dataset = open(&scene, None);
    let views: Vec<&View> = dataset.train.iter().collect();
    assert!(refusal(folder(&scene)).contains("no such folder"));
    scene.write("depths/01.pfm", pfm("-1", f32::to_le_bytes));
    let depths = folder(&scene).expect("a folder");
    let message = refusal(depths.check_complete(&views));
    assert!(message.contains("2 of 3 photos") && message.contains("00.png, 02.png"), "{message}");
    depths.check_complete(&views[1..2]).expect("01 is there");
    refusal(depths.read(views[0]));
}

#[test]
fn maps_follow_the_size_of_the_view() {
    let scene = simple(1);
    // Twice as large as the photo; the four pixels of each photo pixel are equal.
    let large: Vec<f32> = (0..24 * 16).map(|i| value(i / 48 * 12 + i % 24 / 2)).collect();
    files::image::write_exr_y(scene.at("depths/00.exr"), 24, 16, &large).expect("written");
    assert_eq!(read(&scene).expect("a map").values, values());
    let dataset = open(&scene, Some(6));
    let half = folder(&scene).expect("a folder").read(&dataset.train[0]).expect("a map");
    // The centre of a half-size pixel is a corner of four; the lower right one is used.
    let expected: Vec<f32> = (0..24).map(|i| value((i / 6 * 2 + 1) * 12 + i % 6 * 2 + 1)).collect();
    assert_eq!((half.width, half.height, half.values), (6, 4, expected));
}

/// Ids and depths with the same numbers are resampled alike through a lens.
#[test]
fn maps_are_undistorted_as_masks_are() {
    let scene = Scene::new();
    let camera = ColmapCamera { model: 2, name: "SIMPLE_RADIAL", size: (12, 8), parameters: vec![9.0, 6.0, 4.0, 0.35] };
    scene.colmap_bin("sparse/0", &[camera], &["00.png"]);
    scene.photo("images/00.png", 12, 8);
    for folder in ["depths", "masks"] {
        png(&scene.at(&format!("{folder}/00.png")), png::BitDepth::Sixteen, png::ColorType::Grayscale, &words());
    }
    let masks = Some(scene.path().join("masks"));
    let options = LoadOptions { masks, ..all() };
    let dataset = scenes::open(scene.path(), &options).expect("a scene");
    let ids = dataset.train[0].mask().expect("read").expect("a mask").ids.clone();
    let found = read(&scene).expect("a map").values;
    assert!(found.iter().any(|depth| depth.is_nan()), "the lens leaves pixels without a source");
    let moved = |(index, depth): (usize, &f32)| !depth.is_nan() && *depth != value(index);
    assert!(found.iter().enumerate().any(moved), "the lens moves pixels");
    for (&depth, &id) in found.iter().zip(&ids) {
        assert!(if id == 0 { depth.is_nan() } else { depth == f32::from(id) }, "{depth} and {id}");
    }
}
