//! Writers of all importable mask formats, from a single ground truth.

use super::fixtures::{Scene, simple};
use std::fs;
use std::path::Path;

/// Size of the images; it is that of the photos of `simple`.
pub const SIZE: (u32, u32) = (12, 8);

/// Photos of the scene.
pub const PHOTOS: usize = 5;

/// True ids 0 to 3 per pixel: three objects that move a little on a background of 0.
pub fn truth(photo: usize) -> Vec<u16> {
    let at = |x: usize, y: usize| match (x.wrapping_sub(photo), y) {
        (0..3, 1..5) => 1,
        (3..6, 1..5) => 2,
        (0..5, 5..7) => 3,
        _ => 0,
    };
    (0..96).map(|index| at(index % 12, index / 12)).collect()
}

pub fn name(photo: usize) -> String {
    format!("{photo:02}")
}

/// A scene with `PHOTOS` photos.
pub fn scene() -> Scene {
    simple(PHOTOS)
}

pub fn png(path: &Path, size: (u32, u32), colour: png::ColorType, depth: png::BitDepth, bytes: &[u8]) {
    fs::create_dir_all(path.parent().expect("a parent")).expect("a folder");
    let mut encoder = png::Encoder::new(fs::File::create(path).expect("a file"), size.0, size.1);
    encoder.set_color(colour);
    encoder.set_depth(depth);
    if colour == png::ColorType::Indexed {
        // All entries have the same colour, so a reader of colours loses the ids.
        encoder.set_palette(vec![9; 768]);
    }
    encoder.write_header().expect("a header").write_image_data(bytes).expect("pixels");
}

pub fn grey8(path: &Path, bytes: &[u8]) {
    png(path, SIZE, png::ColorType::Grayscale, png::BitDepth::Eight, bytes);
}

/// Id images `folder/NAME.png` in which the objects 1, 2 and 3 have the given `ids`.
pub fn id_pictures(folder: &Path, colour: png::ColorType, depth: png::BitDepth, ids: [u32; 3]) {
    for photo in 0..PHOTOS {
        let source = truth(photo).into_iter().map(|id| if id == 0 { 0 } else { ids[usize::from(id) - 1] });
        let bytes: Vec<u8> = match (colour, depth) {
            (png::ColorType::Rgb, _) => source.flat_map(|id| id.to_le_bytes().into_iter().take(3)).collect(),
            (_, png::BitDepth::Sixteen) => source.flat_map(|id| (id as u16).to_be_bytes()).collect(),
            _ => source.map(|id| id as u8).collect(),
        };
        png(&folder.join(name(photo)).with_extension("png"), SIZE, colour, depth, &bytes);
    }
}

/// Black and white images at `path(object, photo)`, for these object numbers.
pub fn binary(white: u8, objects: &[u16], path: impl Fn(u16, usize) -> std::path::PathBuf) {
    for photo in 0..PHOTOS {
        for &object in objects {
            let bytes: Vec<u8> = truth(photo).iter().map(|&id| if id == object { white } else { 0 }).collect();
            grey8(&path(object, photo), &bytes);
        }
    }
}

/// DEVA's `pred.json` for these ids; the first two have categories.
pub fn pred(ids: [u32; 3]) -> String {
    let segments: Vec<String> = ids
        .iter()
        .zip(["0", "0", "null"])
        .map(|(id, category)| format!(r#"{{"id": {id}, "category_id": {category}, "score": 0.9, "area": 5}}"#))
        .collect();
    format!(r#"{{"annotations": [{{"file_name": "00.jpg", "segments_info": [{}]}}]}}"#, segments.join(","))
}
