//! Prompts, and the layout of a photo in a network.

use super::interface::Fit;
use super::network::Answer;
use image::imageops::{FilterType, resize};
use image::{Rgb, RgbImage};
use labelgs_scene::Photo;

/// Mask cells per side of these networks' square.
pub(crate) const MASK_GRID_SIDE: usize = 256;

/// A position in a photo, px.
pub type PhotoPoint = [f32; 2];

/// What to segment.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Prompt {
    /// Points on the object.
    pub on: Vec<PhotoPoint>,
    /// Points off the object.
    pub off: Vec<PhotoPoint>,
    /// A box around the object: its smallest and its largest corner.
    pub area: Option<[PhotoPoint; 2]>,
}

impl Prompt {
    /// Prompts with a single point on the object.
    pub fn from_point(place: PhotoPoint) -> Self {
        Self { on: vec![place], ..Self::default() }
    }

    /// Returns the prompt for a photo of another size, with all positions multiplied by `scale`.
    pub fn scaled(&self, scale: [f32; 2]) -> Self {
        let place = |place: &PhotoPoint| [place[0] * scale[0], place[1] * scale[1]];
        let places = |places: &[PhotoPoint]| places.iter().map(place).collect();
        Self {
            on: places(&self.on),
            off: places(&self.off),
            area: self.area.map(|corners| corners.map(|corner| place(&corner))),
        }
    }

    /// Returns the points for the decoder, in its pixels, with their types: 1 on, 0 off, 2 and 3 corners, -1 padding.
    pub(crate) fn tensors(&self, frame: &Frame) -> (Vec<f32>, Vec<f32>) {
        let on = self.on.iter().map(|place| (place, 1.0)).chain(self.off.iter().map(|place| (place, 0.0)));
        let corners = self.area.iter().flat_map(|[least, largest]| [(least, 2.0), (largest, 3.0)]);
        let (mut coordinates, mut labels) = (Vec::new(), Vec::new());
        for (place, label) in on.chain(corners) {
            coordinates.extend([place[0] * frame.scale[0], place[1] * frame.scale[1]]);
            labels.push(label);
        }
        // Without a box, these networks were trained with a padding point.
        if self.area.is_none() {
            coordinates.extend([0.0, 0.0]);
            labels.push(-1.0);
        }
        (coordinates, labels)
    }

    /// Selects the masks that answer this kind of prompt. Of four masks, the first is for several points or a box; the
    /// others are a part, an object and a whole for a single point.
    pub(crate) fn choose(&self, frame: &Frame, logits: &[f32], scores: &[f32]) -> Answer {
        let single = self.area.is_none() && self.on.len() + self.off.len() == 1;
        let chosen = match (scores.len(), single) {
            (4, true) => 1..4,
            (4, false) => 0..1,
            (count, _) => 0..count,
        };
        let (width, height) = frame.grid();
        let cropped = |mask: usize| {
            let rows = logits[mask * MASK_GRID_SIDE * MASK_GRID_SIDE..][..MASK_GRID_SIDE * MASK_GRID_SIDE]
                .chunks(MASK_GRID_SIDE)
                .take(height);
            rows.flat_map(|row| &row[..width]).copied().collect()
        };
        Answer { masks: chosen.clone().map(cropped).collect(), scores: chosen.map(|mask| scores[mask]).collect() }
    }
}

/// The layout of a photo in a network's square and on its mask grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Width and height of the photo, px.
    pub size: (u32, u32),
    /// Side of the square, px.
    pub side: usize,
    /// Network pixels per photo pixel, along x and y.
    pub scale: [f32; 2],
    /// The part of the square that the photo covers, px.
    covered: (u32, u32),
}

impl Frame {
    /// Computes the layout of a photo with the given size.
    pub(crate) fn new(size: (u32, u32), side: usize, fit: Fit) -> Self {
        let square = side as u32;
        let covered = match fit {
            Fit::Stretched => (square, square),
            Fit::Padded => {
                let scale = side as f64 / f64::from(size.0.max(size.1));
                let along = |side: u32| ((f64::from(side) * scale + 0.5) as u32).clamp(1, square);
                (along(size.0), along(size.1))
            }
        };
        let scale = [covered.0 as f32 / size.0 as f32, covered.1 as f32 / size.1 as f32];
        Self { size, side, scale, covered }
    }

    /// Returns the width and height of the photo on the mask grid, cells.
    pub fn grid(&self) -> (usize, usize) {
        let cells = |px: u32| (px as usize * MASK_GRID_SIDE).div_ceil(self.side).clamp(1, MASK_GRID_SIDE);
        (cells(self.covered.0), cells(self.covered.1))
    }

    /// Resizes the photo for the network.
    pub(crate) fn resized(&self, photo: &Photo) -> RgbImage {
        let at = |x: u32, y: u32| {
            let [r, g, b, _] = photo.rgba[(y * photo.width + x) as usize];
            Rgb([r, g, b])
        };
        let picture = RgbImage::from_fn(photo.width, photo.height, at);
        resize(&picture, self.covered.0, self.covered.1, FilterType::Triangle)
    }

    /// Returns a flag for each pixel of an image of the photo, of any size: true where the interpolated logit is
    /// positive.
    pub fn drawn(&self, logits: &dyn Fn(usize) -> f32, (width, height): (u32, u32)) -> Vec<bool> {
        let step = [self.size.0 as f32 / width as f32, self.size.1 as f32 / height as f32];
        let grid = self.grid();
        let inside = |at: u32| {
            let place = [((at % width) as f32 + 0.5) * step[0], ((at / width) as f32 + 0.5) * step[1]];
            self.logit(grid, logits, place) > 0.0
        };
        (0..width * height).map(inside).collect()
    }

    /// Returns the logit of a mask at a position in the photo, px, interpolated between cell centres.
    fn logit(&self, grid: (usize, usize), logits: &dyn Fn(usize) -> f32, place: PhotoPoint) -> f32 {
        let along = |axis: usize, cells: usize| {
            let at = place[axis] * self.scale[axis] * MASK_GRID_SIDE as f32 / self.side as f32 - 0.5;
            let at = at.clamp(0.0, (cells - 1) as f32);
            let first = (at as usize).min(cells.saturating_sub(2));
            (first, (first + 1).min(cells - 1), at - first as f32)
        };
        let ((left, right, x), (top, bottom, y)) = (along(0, grid.0), along(1, grid.1));
        let row = |row: usize| logits(row * grid.0 + left) * (1.0 - x) + logits(row * grid.0 + right) * x;
        row(top) * (1.0 - y) + row(bottom) * y
    }
}
