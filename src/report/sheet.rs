//! A sheet of labels: an image of each label alone, with its id, name and size.

use super::page::page as whole_page;
use super::text::{count, number};
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use labelgs_files::image::png_rgba8;
use labelgs_scene::{Result, label_colour};
use maud::html;

/// Side of an image of a label, px.
pub const TILE_SIDE: u32 = 192;
/// Colour behind labels in an image, between the dark and the bright ones.
const BACKGROUND_GREY: u8 = 150;
/// Height of the line with the id, and space between images, px.
const CAPTION_HEIGHT: u32 = 24;
const TILE_GAP: u32 = 8;
/// Size of a dot of a digit, px.
const DIGIT_DOT_SIDE: u32 = 3;
/// Rows of the digits 0 to 9 from the top, three dots each, the left one in the highest bit.
const DIGIT_ROWS: [[u8; 5]; 10] = [
    [0b111, 0b101, 0b101, 0b101, 0b111],
    [0b010, 0b110, 0b010, 0b010, 0b111],
    [0b111, 0b001, 0b111, 0b100, 0b111],
    [0b111, 0b001, 0b111, 0b001, 0b111],
    [0b101, 0b101, 0b111, 0b001, 0b001],
    [0b111, 0b100, 0b111, 0b001, 0b111],
    [0b111, 0b100, 0b111, 0b101, 0b111],
    [0b111, 0b001, 0b010, 0b010, 0b010],
    [0b111, 0b101, 0b111, 0b101, 0b111],
    [0b111, 0b101, 0b111, 0b001, 0b111],
];

/// A label on a sheet.
#[derive(Clone, Debug)]
pub struct Tile {
    /// The label.
    pub id: u32,
    /// Its name, if it has one.
    pub name: Option<String>,
    /// Number of its Gaussians.
    pub gaussians: u64,
    /// Its extent along x, y and z, world units.
    pub size: [f64; 3],
    /// Its image of [`TILE_SIDE`] x [`TILE_SIDE`] px, row-major: r, g, b and opacity.
    pub pixels: Vec<[u8; 4]>,
}

/// Returns a page of labels, with the images inside.
pub fn page(title: &str, tiles: &[Tile]) -> Result<String> {
    let picture = |tile: &Tile| -> Result<String> {
        Ok(format!("data:image/png;base64,{}", STANDARD.encode(png_rgba8((TILE_SIDE, TILE_SIDE), &tile.pixels)?)))
    };
    let pictures = tiles.iter().map(picture).collect::<Result<Vec<_>>>()?;
    let colour = |id: u32| {
        let [r, g, b] = label_colour(id);
        format!("border-color: rgb({r} {g} {b})")
    };
    let body = html! {
        div.sheet {
            @for (tile, picture) in tiles.iter().zip(&pictures) {
                @let name = tile.name.as_deref().unwrap_or("–");
                figure.label style=(colour(tile.id)) {
                    img loading="lazy" width=(TILE_SIDE) height=(TILE_SIDE) alt=(format!("label {} {name}", tile.id)) src=(picture);
                    figcaption {
                        strong { (tile.id) } " " (name)
                        p.quiet { (count(tile.gaussians)) " Gaussians" br; (extent(tile.size)) }
                    }
                }
            }
        }
    };
    let lead = html! {
        p.quiet {
            "Each label alone, from its best view. Sizes are along x, y and z, in world units. The edge has the \
             colour of the label in label maps."
        }
    };
    Ok(whole_page(title, &lead, &body))
}

fn extent(size: [f64; 3]) -> String {
    size.map(|side| number(Some(side), 3)).join(" × ")
}

/// Returns size and pixels of an image of labels with their ids below, in rows from the left.
pub fn picture(tiles: &[Tile]) -> ((u32, u32), Vec<[u8; 3]>) {
    let count = tiles.len().max(1) as u32;
    let across = f64::from(count).sqrt().ceil() as u32;
    let (step, fall) = (TILE_SIDE + TILE_GAP, TILE_SIDE + CAPTION_HEIGHT + TILE_GAP);
    let (width, height) = (across * step + TILE_GAP, count.div_ceil(across) * fall + TILE_GAP);
    let mut pixels = vec![[BACKGROUND_GREY; 3]; (width * height) as usize];
    let mut put = |x: u32, y: u32, [r, g, b, opacity]: [u8; 4]| {
        let over = |colour: u8, below: u8| {
            let (share, all) = (u32::from(opacity), u32::from(u8::MAX));
            ((u32::from(colour) * share + u32::from(below) * (all - share) + all / 2) / all) as u8
        };
        if let Some(below) = pixels.get_mut((y * width + x) as usize).filter(|_| x < width) {
            *below = [over(r, below[0]), over(g, below[1]), over(b, below[2])];
        }
    };
    for (tile, at) in tiles.iter().zip(0..) {
        let (left, top) = (TILE_GAP + at % across * step, TILE_GAP + at / across * fall);
        for (pixel, at) in tile.pixels.iter().zip(0..) {
            put(left + at % TILE_SIDE, top + at / TILE_SIDE, *pixel);
        }
        let [r, g, b] = label_colour(tile.id);
        for (x, y) in (0..CAPTION_HEIGHT - TILE_GAP).flat_map(|y| (0..TILE_GAP).map(move |x| (x, y))) {
            put(left + x, top + TILE_SIDE + TILE_GAP / 2 + y, [r, g, b, u8::MAX]);
        }
        dots(tile.id)
            .for_each(|(x, y)| put(left + 2 * TILE_GAP + x, top + TILE_SIDE + TILE_GAP / 2 + y, [0, 0, 0, u8::MAX]));
    }
    ((width, height), pixels)
}

/// The black pixels of a number, from its upper left.
fn dots(number: u32) -> impl Iterator<Item = (u32, u32)> {
    let digits: Vec<usize> = number.to_string().bytes().map(|digit| usize::from(digit - b'0')).collect();
    let dot = |(at, digit): (u32, usize)| {
        let is_set = move |&(x, y): &(u32, u32)| DIGIT_ROWS[digit][y as usize] >> (2 - x) & 1 == 1;
        let all = (0..5).flat_map(|y| (0..3).map(move |x| (x, y))).filter(is_set);
        all.map(move |(x, y)| (DIGIT_DOT_SIDE * (4 * at + x), DIGIT_DOT_SIDE * y))
    };
    let corners = (0..).zip(digits).flat_map(dot);
    corners.flat_map(|(x, y)| {
        (0..DIGIT_DOT_SIDE * DIGIT_DOT_SIDE).map(move |part| (x + part % DIGIT_DOT_SIDE, y + part / DIGIT_DOT_SIDE))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tile(id: u32, colour: [u8; 4]) -> Tile {
        let pixels = vec![colour; (TILE_SIDE * TILE_SIDE) as usize];
        Tile { id, name: Some("<cup>".into()), gaussians: 12_345, size: [1.0, 0.5, 0.25], pixels }
    }

    #[test]
    fn a_page_names_each_label_and_asks_for_nothing() {
        let text =
            page("model.ply", &[tile(7, [9, 8, 7, 255]), Tile { name: None, ..tile(12, [0; 4]) }]).expect("a page");
        for part in
            ["<strong>7</strong> &lt;cup&gt;", "12,345 Gaussians", "1.000 × 0.500 × 0.250", "<strong>12</strong> –"]
        {
            assert!(text.contains(part), "{part} is not in\n{text}");
        }
        assert_eq!(text.matches("data:image/png;base64,").count(), 2);
        assert!(!text.contains("http://") && !text.contains("https://"), "nothing from the network");
    }

    #[test]
    fn a_picture_has_each_label_over_its_id() {
        let tiles = [tile(1, [200, 0, 0, 255]), tile(20, [0, 200, 0, 128]), tile(3, [0; 4])];
        let ((width, height), pixels) = picture(&tiles);
        assert_eq!(
            (width, height),
            (2 * (TILE_SIDE + TILE_GAP) + TILE_GAP, 2 * (TILE_SIDE + CAPTION_HEIGHT + TILE_GAP) + TILE_GAP)
        );
        assert_eq!(pixels.len() as u32, width * height);
        let at = |x: u32, y: u32| pixels[(y * width + x) as usize];
        assert_eq!(at(TILE_GAP + 5, TILE_GAP + 5), [200, 0, 0]);
        // Half over the colour behind.
        assert_eq!(at(TILE_SIDE + 2 * TILE_GAP, TILE_GAP), [75, 175, 75]);
        assert_eq!(at(TILE_GAP, TILE_SIDE + CAPTION_HEIGHT + 2 * TILE_GAP), [BACKGROUND_GREY; 3]);
        // The digit 1: a column of dots in the middle, on a foot.
        let (left, top) = (3 * TILE_GAP, TILE_GAP + TILE_SIDE + TILE_GAP / 2);
        let black = |x: u32, y: u32| at(left + x, top + y) == [0; 3];
        let shape: Vec<Vec<bool>> =
            (0..5).map(|y| (0..3).map(|x| black(DIGIT_DOT_SIDE * x, DIGIT_DOT_SIDE * y)).collect()).collect();
        let (no, yes) = (false, true);
        let one = [[no, yes, no], [yes, yes, no], [no, yes, no], [no, yes, no], [yes, yes, yes]];
        assert_eq!(shape, one.map(|row| row.to_vec()));
        assert_eq!(at(TILE_GAP, top), label_colour(1));
        // An id of many digits stays inside.
        let wide = picture(&[tile(2_147_483_647, [0; 4])]);
        assert_eq!(wide.1.len() as u32, wide.0.0 * wide.0.1);
    }
}
