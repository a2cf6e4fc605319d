//! A step with an exposure of its photo, against the mirrors.

use super::checks::bounds;
use super::compare::{Tolerance, Verdict, close, gradients};
use super::fixture::{Fixture, readable};
use super::judge;
use super::scenes::{Scene, Shape, scene};
use crate::engine::SharedRow;
use crate::error::Result;
use crate::gpu::Gpu;
use crate::pass::KernelShape;
use crate::scheduler::plan::Buf;
use crate::shaders::constants::{EXPOSURE_PRIOR, EXPOSURE_ROWS};
use crate::train::shared::exposure::Exposure;
use crate::train::shared::{Place, SharedLayout, SharedParameters};
use crate::verify::reference::Rules;
use crate::verify::reference::exposure::{ExposureRows, backward, exposed};
use crate::verify::reference::loss::photo_loss;
use std::sync::Arc;

/// Rows of three photos; the step is on the second one, with some channels above 1.
const ROWS: [[f32; 4]; 9] = [
    [0.3, -0.1, 0.0, 0.0],
    [0.1, 0.0, -0.2, 0.0],
    [0.0, 0.3, 0.1, 0.0],
    [0.9, 0.4, -0.3, 0.0],
    [0.2, -0.1, 0.3, 0.0],
    [-0.4, 0.15, 0.05, 0.0],
    [-0.2, 0.1, 0.05, 0.0],
    [0.02, 0.1, 0.0, 0.0],
    [0.0, -0.1, 0.3, 0.0],
];
const OF_PHOTO: usize = EXPOSURE_ROWS as usize;
const PHOTO: usize = 1;

/// A finished step.
pub struct Exposed {
    scene: Scene,
    image: Vec<[f64; 3]>,
    v_image: Vec<[f64; 3]>,
    v_rows: Vec<[f64; 3]>,
}

impl Exposed {
    /// Runs a step on a photo with some saturated pixels.
    pub fn new(gpu: &Arc<Gpu>, kernels: KernelShape) -> Result<Self> {
        let shape = Shape { gaussians: 150, width: 61, height: 45, ..Shape::default() };
        let mut scene = scene(91, &shape);
        scene.target.photo.colours.iter_mut().step_by(5).for_each(|colour| *colour = [1.0; 3]);
        let rows = ROWS.len() as u32;
        let mut fixture = Fixture::with_rows(Arc::clone(gpu), scene, false, (kernels, readable()), rows)?;
        let wide = |rows: Vec<[f32; 4]>| rows.iter().map(|&[r, g, b, _]| [r, g, b].map(f64::from)).collect();
        let pixels = fixture.pixels();
        // The picture of a step without exposure.
        fixture.train()?;
        let image = wide(fixture.get(Buf::IMAGE, pixels)?);
        let place = Place { all: SharedLayout { scene: 0, photo: EXPOSURE_ROWS }, ..Place::default() };
        fixture.engine.set_extension(Exposure::default().extension(place), 1);
        fixture.engine.set_shared(&ROWS)?;
        let of_photo = PHOTO * OF_PHOTO..(PHOTO + 1) * OF_PHOTO;
        fixture.shared = of_photo.map(|row| SharedRow { row: row as u32, rates: [0.0; 4] }).collect();
        fixture.train_with(1)?;
        Ok(Self {
            image,
            v_image: wide(fixture.get(Buf::V_IMAGE, pixels)?),
            v_rows: wide(fixture.get(Buf::V_SHARED, ROWS.len())?),
            scene: fixture.scene,
        })
    }

    /// Compares with the reference: gradients of the picture, of the rows of the photo, and 0 for the other photos.
    pub fn verdict(&self, rules: &Rules, leeway: f64) -> Verdict {
        let of_photo = |photo: usize| -> ExposureRows {
            std::array::from_fn(|row| [0, 1, 2].map(|c| f64::from(ROWS[OF_PHOTO * photo + row][c])))
        };
        let rows = of_photo(PHOTO);
        let photo = &self.scene.target.photo;
        let loss = photo_loss(rules, &exposed(&self.image, &rows), photo);
        if loss.margin() < 1e-6 {
            return Err(format!("a pixel of this seed is too close to the kink of the loss: {}", loss.margin()));
        }
        let photos = ROWS.len() / OF_PHOTO;
        let sum = |row: usize, c: usize| (0..photos).map(|photo| of_photo(photo)[row][c]).sum::<f64>();
        let mean = std::array::from_fn(|row| [0, 1, 2].map(|c| sum(row, c) / photos as f64));
        let prior = (f64::from(EXPOSURE_PRIOR), &mean);
        let (v_image, v_rows) = backward(&self.image, &rows, (&loss.v_image, &photo.colours), prior);
        let flat = |rows: &[[f64; 3]]| rows.as_flattened().to_vec();
        // As for the photo loss, times a gain of up to 2.5.
        let of_image = gradients(&flat(&self.v_image), &flat(&v_image), bounds(2.8e-6, 4.6e-6));
        let mut expected = vec![[0.0; 3]; ROWS.len()];
        expected[PHOTO * OF_PHOTO..(PHOTO + 1) * OF_PHOTO].copy_from_slice(&v_rows);
        // Sums of 2,745 products of either sign, each with the relative error of its gradient.
        let tolerance = Tolerance { absolute: 1e-6 * leeway, relative: 1e-6 * leeway };
        judge::all([of_image, close(&flat(&self.v_rows), &flat(&expected), tolerance)])
    }
}

/// Checks the gradients of a step with an exposure of its photo.
pub(super) fn exposure_of_a_step(rules: &Rules, gpu: &Arc<Gpu>, kernels: KernelShape, leeway: f64) -> Result<Verdict> {
    Ok(Exposed::new(gpu, kernels)?.verdict(rules, leeway))
}
