//! A tiny segmenter, and photos whose objects it tells apart.

#[path = "../../src/segment/tests/tiny.rs"]
pub mod tiny;

use labelgs::files::image::write_png_rgb8;
use labelgs::masks::read_mask;
use std::path::Path;

/// Paints each photo of a scene of `synth --preset simple` in a flat colour for each object.
pub fn paint(scene: &Path) {
    const COLOURS: [[u8; 3]; 4] = [[40, 40, 40], [255, 40, 40], [40, 255, 40], [60, 60, 255]];
    for entry in std::fs::read_dir(scene.join("images")).expect("a folder") {
        let photo = entry.expect("a photo").path();
        let mask = read_mask(scene.join("masks").join(photo.file_name().expect("a name"))).expect("ids");
        let pixels: Vec<[u8; 3]> = mask.ids.iter().map(|&id| COLOURS[usize::from(id)]).collect();
        write_png_rgb8(photo, mask.width, mask.height, &pixels).expect("painted");
    }
}

/// Returns the object of which a view shows most, and a pixel in the middle of it.
pub fn largest_object(scene: &Path, view: &str) -> (u16, [u32; 2]) {
    let mask = read_mask(scene.join(format!("masks/{view}.png"))).expect("ids");
    let pixels = |id: u16| mask.ids.iter().filter(|found| **found == id).count();
    let object = mask.objects().into_iter().max_by_key(|&id| pixels(id)).expect("an object");
    (object, pixel_of(scene, view, object))
}

/// Returns a pixel in the middle of an object.
pub fn pixel_of(scene: &Path, view: &str, object: u16) -> [u32; 2] {
    let mask = read_mask(scene.join(format!("masks/{view}.png"))).expect("ids");
    let pixels: Vec<usize> = (0..mask.ids.len()).filter(|&at| mask.ids[at] == object).collect();
    let middle = pixels[pixels.len() / 2] as u32;
    [middle % mask.width, middle / mask.width]
}
