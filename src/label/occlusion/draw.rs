//! Pictures of occluders.

use super::walk;
use crate::scene::labels::label_colour;
use crate::scene::{LabelMap, Occluders};

const IN_FRONT_COLOUR: [u8; 3] = [255; 3];
const BEHIND_COLOUR: [u8; 3] = [0; 3];
const NEITHER_COLOUR: [u8; 3] = [128; 3];

/// Draws the objects in their colours, darkened by a third, with a line of two pixels along each contour: white on the
/// front side and black on the back side, or grey if neither object hides the other. Unlabelled areas have a line where
/// they hide an object. Chains have no contour and no line.
pub fn picture(labels: &LabelMap, occluders: &Occluders) -> Vec<[u8; 3]> {
    let fill = |&id: &u16| label_colour(u32::from(id)).map(|channel| (u16::from(channel) * 2 / 3) as u8);
    let mut pixels: Vec<[u8; 3]> = labels.ids.iter().map(fill).collect();
    let hides = |front: u16, back: u16| occluders.get(&back).is_some_and(|by| by.contains(&front));
    let mut drawn = vec![0_u8; pixels.len()];
    walk(labels, |own, other, pixel, _| {
        // Where three objects meet, the front colour wins.
        let (rank, colour) = match (hides(own, other), hides(other, own)) {
            (true, _) => (3, IN_FRONT_COLOUR),
            (_, true) => (2, BEHIND_COLOUR),
            _ if own == 0 || other == 0 => return,
            _ => (1, NEITHER_COLOUR),
        };
        if rank > drawn[pixel] {
            (drawn[pixel], pixels[pixel]) = (rank, colour);
        }
    });
    pixels
}
