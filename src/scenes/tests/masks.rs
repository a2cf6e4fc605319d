//! Id images: encodings, names, sizes.

use super::fixtures::*;
use super::{all, noted};
use labelgs_masks::read_mask;
use labelgs_scene::Dataset;
use labelgs_scenes::{self as scenes, LoadOptions};
use std::fs;
use std::path::Path;

fn png(path: &Path, size: (u32, u32), colour: png::ColorType, depth: png::BitDepth, bytes: &[u8]) {
    let mut encoder = png::Encoder::new(fs::File::create(path).expect("a file"), size.0, size.1);
    encoder.set_color(colour);
    encoder.set_depth(depth);
    if colour == png::ColorType::Indexed {
        // All entries have the same colour, so a reader of colours loses the ids.
        encoder.set_palette(vec![9u8; 3 * (1 << (depth as usize).min(8))]);
    }
    encoder.write_header().expect("a header").write_image_data(bytes).expect("pixels");
}

fn open(scene: &Scene, max_resolution: Option<u32>) -> labelgs_scene::Result<Dataset> {
    let masks = Some(scene.path().join("masks"));
    scenes::open(scene.path(), &LoadOptions { masks, max_resolution, ..all() })
}

#[test]
fn ids_are_exact_in_every_encoding() {
    let scene = Scene::new();
    let path = scene.at("m.png");
    let read = |colour, depth, width: u32, bytes: &[u8]| {
        png(&path, (width, 2), colour, depth, bytes);
        read_mask(&path).expect("a mask").ids
    };
    use png::BitDepth::{Eight, Four, One, Sixteen, Two};
    use png::ColorType::{Grayscale, Indexed};
    for colour in [Grayscale, Indexed] {
        assert_eq!(read(colour, Eight, 3, &[0, 1, 3, 255, 128, 7]), [0, 1, 3, 255, 128, 7]);
        assert_eq!(read(colour, Four, 3, &[0x1f, 0x20, 0x34, 0x50]), [1, 15, 2, 3, 4, 5]);
        assert_eq!(read(colour, Two, 5, &[0b00_01_10_11, 0b01_000000, 0xff, 0xff]), [0, 1, 2, 3, 1, 3, 3, 3, 3, 3]);
        assert_eq!(read(colour, One, 9, &[0b1010_0000, 0x80, 0, 0])[..9], [1, 0, 1, 0, 0, 0, 0, 0, 1]);
    }
    let wide = [0u16, 256, 257, 65535, 9000, 1].map(u16::to_be_bytes).concat();
    assert_eq!(read(Grayscale, Sixteen, 3, &wide), [0, 256, 257, 65535, 9000, 1]);
}

#[test]
fn colours_jpegs_and_bombs_are_refused() {
    let scene = Scene::new();
    let path = scene.at("m.png");
    for (colour, samples) in [(png::ColorType::Rgb, 3), (png::ColorType::Rgba, 4), (png::ColorType::GrayscaleAlpha, 2)]
    {
        let mut bytes = vec![255; 4 * samples];
        bytes[0] = 1;
        // The last of two channels is opacity.
        bytes[samples - 1] = if samples == 2 { 9 } else { 255 };
        png(&path, (2, 2), colour, png::BitDepth::Eight, &bytes);
        let expected = if samples == 2 { "transparent pixels" } else { "Import the folder" };
        assert!(refusal(read_mask(&path)).contains(expected));
    }
    png(&path, (40_000, 40_000), png::ColorType::Grayscale, png::BitDepth::One, &vec![0; 5000 * 40_000]);
    assert!(refusal(read_mask(&path)).contains("40000 x 40000"));
    fs::write(&path, b"not a png").expect("written");
    assert!(refusal(read_mask(&path)).contains("PNG"));
    fs::write(&path, b"").expect("written");
    refusal(read_mask(&path));
    fs::write(&path, [0xff, 0xd8, 0xff, 0xe0, 0, 16]).expect("written");
    assert!(refusal(read_mask(&path)).contains("is a JPEG"));
}

#[test]
fn equal_channels_are_ids_where_opacity_says_nothing() {
    let scene = Scene::new();
    let path = scene.at("m.png");
    let ids = [0_u16, 1, 200, 255];
    for (colour, colours, alpha) in [
        (png::ColorType::Rgb, 3, None),
        (png::ColorType::Rgba, 3, Some(255)),
        (png::ColorType::GrayscaleAlpha, 1, Some(255)),
        (png::ColorType::Grayscale, 1, None),
    ] {
        let pixel = |id: &u16| std::iter::repeat_n(*id as u8, colours).chain(alpha).collect::<Vec<u8>>();
        png(&path, (2, 2), colour, png::BitDepth::Eight, &ids.iter().flat_map(pixel).collect::<Vec<_>>());
        assert_eq!(read_mask(&path).expect("a mask").ids, ids, "{colour:?}");
        let wide = |id: &u16| std::iter::repeat_n(id * 257, colours).chain(alpha.map(|_| u16::MAX)).collect::<Vec<_>>();
        let bytes: Vec<u8> = ids.iter().flat_map(wide).flat_map(u16::to_be_bytes).collect();
        png(&path, (2, 2), colour, png::BitDepth::Sixteen, &bytes);
        assert_eq!(read_mask(&path).expect("a mask").ids, ids.map(|id| id * 257), "{colour:?}");
    }
    let with_alpha = |bytes: &[u8]| {
        png(&path, (2, 2), png::ColorType::GrayscaleAlpha, png::BitDepth::Eight, bytes);
        read_mask(&path)
    };
    // A transparent background shows nothing behind it.
    assert_eq!(with_alpha(&[0, 0, 7, 255, 0, 9, 0, 255]).expect("a mask").ids, [0, 7, 0, 0]);
    assert!(refusal(with_alpha(&[7, 254, 7, 255, 0, 0, 0, 0])).contains("transparent pixels that are not black"));
    assert!(refusal(with_alpha(&[0, 0, 0, 255, 0, 255, 0, 0])).contains("only its opacity differs"));
}

/// Writes a mask with a single id.
fn flat(scene: &Scene, file: &str, id: u8) {
    png(&scene.at(file), (12, 8), png::ColorType::Grayscale, png::BitDepth::Eight, &[id; 96]);
}

#[test]
fn masks_are_found_across_case_and_composition() {
    let names = ["\u{c9}t\u{e9}.jpg", "B.JPG", "c.jpg", "d.jpg", "D.jpg", "f.jpg"];
    let scene = Scene::new();
    scene.colmap_bin("sparse/0", &[pinhole()], &names);
    names.iter().for_each(|name| scene.photo(&format!("images/{name}"), 12, 8));
    for (id, file) in (1..).zip(["E\u{301}te\u{301}.png", "b.png", "C.PNG", "d.PNG", "F.png", "f.Png"]) {
        flat(&scene, &format!("masks/{file}"), id);
    }
    let dataset = open(&scene, None).expect("a scene");
    let id = |name: &str| {
        let view = dataset.train.iter().find(|view| view.name == name).expect("a view");
        view.mask().expect("read").map(|mask| mask.ids[0])
    };
    // Two photos match d.PNG, and one is spelt exactly so; two files match f.jpg, and one is spelt exactly so.
    assert_eq!(names.map(id), [Some(1), Some(2), Some(3), Some(4), None, Some(6)]);
}

#[test]
fn masks_without_objects_are_noted() {
    let scene = simple(10);
    let notes = || {
        let masks = Some(scene.path().join("masks"));
        scenes::open(scene.path(), &LoadOptions { masks, ..LoadOptions::default() }).expect("a scene").notes
    };
    let has = |text: &str| noted(&notes(), &[text]);
    let files: Vec<String> = (0..10).map(|at| format!("masks/{at:02}.png")).collect();
    // The first and the ninth are held out.
    flat(&scene, &files[0], 1);
    flat(&scene, &files[8], 1);
    has("only held-out photos have masks, so training cannot use them: 00.png, 08.png");
    files.iter().for_each(|file| flat(&scene, file, 0));
    has("every pixel of all 8 masks is 0");
    files.iter().for_each(|file| flat(&scene, file, 255));
    has("every pixel of all 8 masks is 255");
    flat(&scene, &files[3], 0);
    assert_eq!(notes(), Vec::<String>::new());
}

#[test]
fn soft_masks_are_noted_once() {
    let scene = simple(3);
    let row = [0, 0, 0, 40, 90, 200, 255, 255, 255, 160, 0, 0];
    (0..3).for_each(|at| {
        let path = scene.at(&format!("masks/{at:02}.png"));
        png(&path, (12, 8), png::ColorType::Grayscale, png::BitDepth::Eight, &row.repeat(8));
    });
    let notes = open(&scene, None).expect("a scene").notes;
    assert!(notes.len() == 1 && notes[0].contains("3 of 3 examined masks have soft edges"), "{notes:?}");
    assert!(notes[0].contains("`format = binary`"), "{notes:?}");
}

#[test]
fn a_folder_of_another_form_names_the_import() {
    let scene = simple(2);
    let cure = format!("with `masks import {}` and the scene", scene.path().join("masks").display());
    let refused = |file: &str, text: &str| {
        let _ = fs::remove_dir_all(scene.path().join("masks"));
        flat(&scene, "masks/00/0.png", 255);
        scene.write(file, text);
        let message = refusal(open(&scene, None));
        assert!(message.contains(&cure), "{message}");
    };
    refused("masks/00/metadata.csv", "id,area\n0,96\n");
    refused("masks/SegmentationObject/x.txt", "");
    refused("masks/00.json", r#"[{"segmentation": {"size": [8, 12], "counts": "0"}}]"#);
    refused("masks/coco.json", r#"{"images": [], "annotations": [{"image_id": 1}]}"#);
    refused("masks/00/readme.txt", "");
    let file = Some(scene.write("coco.json", "{}"));
    let message = refusal(scenes::open(scene.path(), &LoadOptions { masks: file, ..LoadOptions::default() }));
    assert!(message.contains("is a file") && message.contains("masks import"), "{message}");
    fs::remove_dir_all(scene.path().join("masks")).expect("removed");
    flat(&scene, "masks/other.png", 1);
    let message = refusal(open(&scene, None));
    assert!(message.contains("expected for example 00.png; it holds other.png"), "{message}");
}

#[test]
fn masks_are_found_by_every_naming() {
    let scene = Scene::new();
    let names = ["a.cam.jpg", "left/b.jpg", "c.jpg", "d.png", "left/e.png", "right/e.png"];
    scene.colmap_bin("sparse/0", &[pinhole()], &names);
    names.iter().for_each(|name| scene.photo(&format!("images/{name}"), 12, 8));
    let files = ["a.png", "b.png", "c.jpg.png", "d.png", "left/e.png", "e.png"];
    for (index, file) in files.iter().enumerate() {
        png(
            &scene.at(&format!("masks/{file}")),
            (12, 8),
            png::ColorType::Grayscale,
            png::BitDepth::Eight,
            &[index as u8 + 1; 96],
        );
    }
    let dataset = open(&scene, None).expect("a scene");
    let id = |name: &str| {
        dataset.train.iter().find(|v| v.name == name).and_then(|v| v.mask().expect("read")).map(|m| m.ids[0])
    };
    assert_eq!(names.map(id), [Some(1), Some(2), Some(3), Some(4), Some(5), None]);
    noted(&dataset.notes, &["1 of 6 photos have no mask: right/e.png"]);
    fs::remove_dir_all(scene.path().join("masks")).expect("removed");
    assert!(refusal(open(&scene, None)).contains("no such folder"));
    fs::create_dir(scene.path().join("masks")).expect("made");
    assert!(refusal(open(&scene, None)).contains("a.cam.png"));
}

#[test]
fn other_sizes_are_scaled_by_nearest_id() {
    let scene = simple(1);
    let path = scene.at("masks/00.png");
    let ids: Vec<u8> = (0..24 * 16).map(|index| if index % 24 < 12 { 7 } else { 200 }).collect();
    png(&path, (24, 16), png::ColorType::Grayscale, png::BitDepth::Eight, &ids);
    for (bound, size) in [(None, (12, 8)), (Some(6), (6, 4)), (Some(5), (5, 3))] {
        let dataset = open(&scene, bound).expect("a scene");
        let mask = dataset.train[0].mask().expect("read").expect("a mask");
        assert_eq!((mask.width, mask.height), size);
        assert_eq!(mask.objects(), [7, 200]);
        assert!((0..size.1).all(|y| mask.at(0, y) == 7 && mask.at(size.0 - 1, y) == 200));
        noted(&dataset.notes, &["1 mask of another size"]);
    }
    png(&path, (12, 12), png::ColorType::Grayscale, png::BitDepth::Eight, &[1; 144]);
    assert!(refusal(open(&scene, None)).contains("12 x 12"));
}

#[test]
fn ids_shrink_with_the_photo() {
    let scene = simple(1);
    let ids: Vec<u8> = (0..96).map(|index| (index % 12) as u8).collect();
    png(&scene.at("masks/00.png"), (12, 8), png::ColorType::Grayscale, png::BitDepth::Eight, &ids);
    let dataset = open(&scene, Some(4)).expect("a scene");
    let mask = dataset.train[0].mask().expect("read").expect("a mask");
    // The pixel under the centre of each target pixel: 1.5, 4.5, 7.5 and 10.5 px from the left.
    assert_eq!(mask.ids[..4], [1, 4, 7, 10]);
}

#[test]
fn ignored_pixels_have_no_weight() {
    let scene = simple(2);
    let half: Vec<u8> = (0..6 * 4).map(|index| u8::from(index % 6 < 3) * 7).collect();
    png(&scene.at("ignore/00.png"), (6, 4), png::ColorType::Grayscale, png::BitDepth::Eight, &half);
    let open = |scene: &Scene| {
        let ignore = Some(scene.path().join("ignore"));
        scenes::open(scene.path(), &LoadOptions { ignore, ..all() })
    };
    let dataset = open(&scene).expect("a scene");
    let alphas = |view: usize| {
        let photo = dataset.train[view].photo().expect("a photo");
        photo.rgba.iter().map(|texel| texel[3]).collect::<Vec<u8>>()
    };
    assert!(alphas(0).iter().enumerate().all(|(at, &alpha)| alpha == if at % 12 < 6 { 0 } else { 255 }));
    assert!(alphas(1).iter().all(|&alpha| alpha == 255), "a photo without a picture counts as a whole");
    noted(&dataset.notes, &["1 of 2 photos have no picture of what to ignore: 01.png"]);
    // Colours are accepted too; opacity is ignored.
    let colours: Vec<u8> = half.iter().flat_map(|&value| [0, value, 0, 255]).collect();
    png(&scene.at("ignore/00.png"), (6, 4), png::ColorType::Rgba, png::BitDepth::Eight, &colours);
    let photo = |dataset: &Dataset| dataset.train[0].photo().expect("a photo");
    assert_eq!(*photo(&open(&scene).expect("a scene")), *photo(&dataset));
    // Nothing remains of one photo, or of all.
    png(&scene.at("ignore/00.png"), (6, 4), png::ColorType::Grayscale, png::BitDepth::Eight, &[255; 24]);
    let rest = open(&scene).expect("a scene");
    assert_eq!(rest.train.iter().map(|view| view.name.as_str()).collect::<Vec<_>>(), ["01.png"]);
    noted(&rest.notes, &["1 views are skipped, because 00.png have no valid pixel"]);
    png(&scene.at("ignore/01.png"), (6, 4), png::ColorType::Grayscale, png::BitDepth::Eight, &[1; 24]);
    assert!(refusal(open(&scene)).contains("no valid pixel"));
    fs::remove_file(scene.at("ignore/01.png")).expect("removed");
    png(&scene.at("ignore/00.png"), (6, 4), png::ColorType::Grayscale, png::BitDepth::Eight, &half);
    // The same through a lens: no colour of an ignored pixel is mixed in.
    let fisheye = ColmapCamera { model: 15, name: "FISHEYE", size: (12, 8), parameters: vec![10.0, 10.0, 6.0, 4.0] };
    scene.colmap_bin("sparse/0", &[fisheye], &["00.png", "01.png"]);
    let bent = open(&scene).expect("a scene");
    let photo = bent.train[0].photo().expect("a photo");
    let left = photo.rgba.iter().enumerate().filter(|(at, _)| (at % photo.width as usize) < photo.width as usize / 2);
    assert!(left.into_iter().all(|(_, texel)| *texel == [0; 4]) && photo.rgba.iter().any(|texel| texel[3] == 255));
    png(&scene.at("ignore/00.png"), (6, 8), png::ColorType::Grayscale, png::BitDepth::Eight, &[0; 48]);
    assert!(refusal(open(&scene)).contains("no scale explains"));
    fs::write(scene.at("ignore/00.png"), b"text").expect("written");
    assert!(refusal(open(&scene)).contains("PNG"));
    fs::remove_file(scene.at("ignore/00.png")).expect("removed");
    assert!(refusal(open(&scene)).contains("expected for example 00.png"));
    fs::remove_dir(scene.at("ignore")).expect("removed");
    assert!(refusal(open(&scene)).contains("no such folder"));
}
