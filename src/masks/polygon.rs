//! Rasterises polygons: a pixel is inside if its centre is, by the even-odd rule. Several polygons form a single area.

use super::spans::Spans;
use serde_json::Value;

/// Largest coordinate, beyond any image.
const COORDINATE_MAX: f64 = 1e6;

/// The outlines of an object in an image.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Polygons {
    /// Width and height of the image, px.
    pub(super) size: (u32, u32),
    outlines: Vec<Vec<[f64; 2]>>,
}

impl Polygons {
    /// Reads a list of lists `[x, y, x, y, ...]`. The error describes what is wrong.
    pub(super) fn read(lists: &[Value], size: (u32, u32)) -> Result<Self, String> {
        let outline = |(at, list): (usize, &Value)| {
            let numbers: Option<Vec<f64>> = list.as_array().and_then(|list| list.iter().map(Value::as_f64).collect());
            let Some(numbers) = numbers else {
                return Err(format!("polygon {} is not a list of numbers; expected [x, y, x, y, x, y]", at + 1));
            };
            if numbers.len() < 6 || numbers.len() % 2 == 1 {
                let count = numbers.len();
                return Err(format!("polygon {} has {count} numbers; expected x and y of 3 points or more", at + 1));
            }
            if let Some(far) = numbers.iter().find(|number| !(number.abs() <= COORDINATE_MAX)) {
                return Err(format!("polygon {} has the coordinate {far}; expected pixels of the image", at + 1));
            }
            Ok(numbers.chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect())
        };
        Ok(Self { size, outlines: lists.iter().enumerate().map(outline).collect::<Result<_, _>>()? })
    }

    /// Returns the pixels in an image of another size.
    pub(super) fn spans(&self, (width, height): (u32, u32)) -> Spans {
        let scale = [f64::from(width) / f64::from(self.size.0), f64::from(height) / f64::from(self.size.1)];
        let mut inside = vec![false; width as usize * height as usize];
        for outline in &self.outlines {
            let points: Vec<[f64; 2]> = outline.iter().map(|[x, y]| [x * scale[0], y * scale[1]]).collect();
            fill(&points, (width as usize, height as usize), &mut inside);
        }
        Spans::from_mask(&inside)
    }
}

/// Returns the first of `most` positions whose centre is not before `at`.
fn first(at: f64, most: usize) -> usize {
    // The cast of a negative number is 0.
    ((at - 0.5).ceil() as usize).min(most)
}

fn fill(points: &[[f64; 2]], (width, height): (usize, usize), inside: &mut [bool]) {
    let ys = || points.iter().map(|point| point[1]);
    let top = first(ys().fold(f64::INFINITY, f64::min), height);
    let bottom = first(ys().fold(f64::NEG_INFINITY, f64::max), height);
    // True where a row enters or leaves the polygon.
    let mut turns = vec![false; bottom.saturating_sub(top) * width];
    let next = points.iter().cycle().skip(1);
    for (&[x0, y0], &[x1, y1]) in points.iter().zip(next) {
        let rows = first(y0.min(y1), height)..first(y0.max(y1), height);
        for y in rows {
            let x = x0 + (y as f64 + 0.5 - y0) / (y1 - y0) * (x1 - x0);
            let column = first(x, width);
            if column < width {
                turns[(y - top) * width + column] ^= true;
            }
        }
    }
    if width == 0 {
        return;
    }
    for (turns, inside) in turns.chunks_exact(width).zip(inside[top * width..].chunks_exact_mut(width)) {
        let mut is_inside = false;
        for (turn, inside) in turns.iter().zip(inside) {
            is_inside ^= turn;
            *inside |= is_inside;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn inside(lists: Value, from: (u32, u32), size: (u32, u32)) -> Vec<u8> {
        let mut pixels = vec![0; (size.0 * size.1) as usize];
        let polygons = Polygons::read(lists.as_array().expect("a list"), from).expect("polygons");
        polygons.spans(size).runs().for_each(|run| pixels[run].fill(1));
        pixels
    }

    #[test]
    fn pixels_with_their_centre_inside_are_inside() {
        let square = json!([[1, 1, 3, 1, 3, 2, 1, 2]]);
        assert_eq!(inside(square.clone(), (4, 3), (4, 3)), [0, 0, 0, 0, 0, 1, 1, 0, 0, 0, 0, 0]);
        // Twice as large; and beyond every border.
        assert_eq!(inside(square, (4, 3), (8, 6)).iter().filter(|&&pixel| pixel == 1).count(), 8);
        assert_eq!(inside(json!([[-9, -9, 99, -9, 99, 99, -9, 99]]), (3, 2), (3, 2)), [1; 6]);
        let triangle = inside(json!([[0, 0, 4, 0, 0, 4]]), (4, 4), (4, 4));
        assert_eq!(triangle, [1, 1, 1, 0, 1, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0]);
        // Two polygons that overlap are one area; one that crosses itself has a hole.
        let two = json!([[0, 0, 2, 0, 2, 1, 0, 1], [1, 0, 3, 0, 3, 1, 1, 1]]);
        assert_eq!(inside(two, (4, 1), (4, 1)), [1, 1, 1, 0]);
        let ring = json!([[0, 0, 3, 0, 3, 1, 0, 1, 0, 0, 1, 0, 1, 1, 2, 1, 2, 0, 1, 0]]);
        assert_eq!(inside(ring, (3, 1), (3, 1)), [1, 0, 1]);
    }

    #[test]
    fn wrong_polygons_are_told() {
        for (lists, expected) in [
            (json!([5]), "polygon 1 is not a list"),
            (json!([[1, 2, 3, 4, 5, 6], [1, "x"]]), "polygon 2 is not a list"),
            (json!([[1, 2, 3, 4]]), "4 numbers"),
            (json!([[1, 2, 3, 4, 5, 6, 7]]), "7 numbers"),
            (json!([[1, 2, 3, 1e300, 5, 6]]), "the coordinate"),
        ] {
            let message = Polygons::read(lists.as_array().expect("a list"), (4, 4)).expect_err("refused");
            assert!(message.contains(expected), "{expected}: {message}");
        }
    }
}
