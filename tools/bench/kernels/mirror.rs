//! The float64 step of the tests (`src/reference`), computed by blocks of the image on all cores, so that
//! benchmark-sized scenes take seconds. Without labels.

use labelgs::reference::blend::{self, Margins, Upstream};
use labelgs::reference::loss::photo_loss;
use labelgs::reference::splat::{Splat, SplatGradient};
use labelgs::reference::{Model, Row, Rules, project, sort};
use labelgs::verify::selftest::scenes::Scene;
use rayon::prelude::*;

/// Side of a block, px.
const BLOCK_SIDE: usize = 32;

/// Results of a step in float64.
pub struct Mirror {
    /// Image, [height, width].
    pub colours: Vec<[f64; 3]>,
    /// Smallest decision margin of each pixel.
    pub pixel_margins: Vec<f64>,
    /// Gradients per Gaussian, [N].
    pub rows: Vec<Row>,
    /// Smallest decision margin that affects each row, [N].
    pub row_margins: Vec<f64>,
}

/// Splats of a view and the inputs of a step.
pub struct View<'a> {
    rules: &'a Rules,
    scene: &'a Scene,
    model: Model,
    splats: Vec<Splat>,
    /// Of the projection, by splat.
    margins: Vec<f64>,
    blocks: Vec<Block>,
}

/// A part of the image and the splats near it.
struct Block {
    corner: [usize; 2],
    size: (usize, usize),
    /// Indices into `View::splats`, nearest first.
    places: Vec<usize>,
}

/// Returns rules without cut-offs: no pixel stops, and pairs count down to 2^-30, below any f32 sum.
pub fn without_cut_offs() -> Rules {
    Rules { alpha_min: (-30.0_f64).exp2(), transmittance_min: 0.0, ..Rules::default() }
}

impl<'a> View<'a> {
    /// Projects and sorts.
    pub fn new(rules: &'a Rules, scene: &'a Scene) -> Self {
        let (model, camera) = (scene.model(), &scene.camera);
        let seen = |gaussian| {
            let projection = project::project_forward(rules, camera, &model, gaussian)?;
            let size = (camera.width as usize, camera.height as usize);
            labelgs::reference::tile::cull(rules, &projection.splat, size).touches.then_some(projection)
        };
        let found: Vec<_> = (0..model.rows.len()).into_par_iter().filter_map(seen).collect();
        let order = sort::depth_sort(&found.iter().map(|projection| projection.splat.depth).collect::<Vec<_>>());
        let splats: Vec<Splat> = order.iter().map(|&i| found[i].splat).collect();
        let margins = order.iter().map(|&i| found[i].clamp_margin.min(found[i].colour_margin)).collect();
        let mut view = Self { rules, scene, model, splats, margins, blocks: Vec::new() };
        view.fill_blocks();
        view
    }

    fn size(&self) -> (usize, usize) {
        self.scene.target.photo.size
    }

    fn fill_blocks(&mut self) {
        let (width, height) = self.size();
        let columns = width.div_ceil(BLOCK_SIDE);
        let block = |index: usize| {
            let corner = [index % columns * BLOCK_SIDE, index / columns * BLOCK_SIDE];
            let size = (BLOCK_SIDE.min(width - corner[0]), BLOCK_SIDE.min(height - corner[1]));
            Block { corner, size, places: Vec::new() }
        };
        self.blocks = (0..columns * height.div_ceil(BLOCK_SIDE)).map(block).collect();
        for (place, splat) in self.splats.iter().enumerate() {
            // One pixel wider than exact, like the mirror's own boxes.
            let Some(reach) = blend::reach(self.rules, splat) else { continue };
            let span = |axis: usize, end: usize| {
                let low = (splat.mean2d[axis] - reach[axis] - 1.0).max(0.0) as usize / BLOCK_SIDE;
                let high = (splat.mean2d[axis] + reach[axis] + 1.0).clamp(0.0, end as f64 - 1.0) as usize / BLOCK_SIDE;
                low..=high
            };
            for row in span(1, height) {
                for column in span(0, width) {
                    self.blocks[row * columns + column].places.push(place);
                }
            }
        }
    }

    /// Returns the splats of a block, with centres relative to its corner.
    fn splats_of(&self, block: &Block) -> Vec<Splat> {
        let moved = |&place: &usize| {
            let splat = self.splats[place];
            let mean2d = [0, 1].map(|axis| splat.mean2d[axis] - block.corner[axis] as f64);
            Splat { mean2d, ..splat }
        };
        block.places.iter().map(moved).collect()
    }

    fn pixel(&self, block: &Block, index: usize) -> usize {
        (block.corner[1] + index / block.size.0) * self.size().0 + block.corner[0] + index % block.size.0
    }

    /// Renders the image and the margins of its pixels.
    pub fn picture(&self) -> (Vec<[f64; 3]>, Vec<f64>) {
        let background = self.scene.target.background;
        let blended: Vec<_> = (self.blocks.par_iter())
            .map(|block| blend::blend_forward(self.rules, &self.splats_of(block), block.size, background))
            .collect();
        let mut colours = vec![[0.0; 3]; self.size().0 * self.size().1];
        let mut margins = vec![0.0; colours.len()];
        for (block, blended) in self.blocks.iter().zip(&blended) {
            for (index, pixel) in blended.pixels.iter().enumerate() {
                let to = self.pixel(block, index);
                colours[to] = pixel.colour;
                margins[to] = Margins::image(&pixel.margins);
            }
        }
        (colours, margins)
    }

    /// Runs the whole step.
    pub fn step(&self) -> Mirror {
        let (colours, pixel_margins) = self.picture();
        let v_image = photo_loss(self.rules, &colours, &self.scene.target.photo).v_image;
        let background = self.scene.target.background;
        let of_blocks: Vec<_> = (self.blocks.par_iter())
            .map(|block| {
                let pixels = block.size.0 * block.size.1;
                let upstream: Vec<_> = (0..pixels).map(|index| v_image[self.pixel(block, index)]).collect();
                let upstream = Upstream::from_colours(&upstream);
                blend::blend_backward(self.rules, &self.splats_of(block), block.size, background, &upstream)
            })
            .collect();
        let mut sums = vec![SplatGradient::default(); self.splats.len()];
        let mut margins = self.margins.clone();
        for (block, of_block) in self.blocks.iter().zip(&of_blocks) {
            for (index, &place) in block.places.iter().enumerate() {
                sums[place] = sums[place].plus(&of_block.values[index]);
                margins[place] = margins[place].min(of_block.margins[index]);
            }
        }
        let (camera, model) = (&self.scene.camera, &self.model);
        let of_splats: Vec<Row> = (self.splats.par_iter().zip(&sums))
            .map(|(splat, v)| project::project_backward(self.rules, camera, model, splat.gaussian, v))
            .collect();
        let mut rows = vec![Row::default(); model.rows.len()];
        let mut row_margins = vec![f64::INFINITY; model.rows.len()];
        for ((splat, row), margin) in self.splats.iter().zip(of_splats).zip(margins) {
            rows[splat.gaussian] = row;
            row_margins[splat.gaussian] = margin;
        }
        Mirror { colours, pixel_margins, rows, row_margins }
    }
}
