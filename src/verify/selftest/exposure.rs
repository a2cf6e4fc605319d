//! A step with an exposure of its photo, against the mirrors.

use super::checks::{bounds, colours};
use super::compare::{Tolerance, close, gradients};
use super::fixture::{Fixture, readable};
use super::scenes::{Shape, scene};
use super::{Judge, LEEWAY, Rig, judge};
use crate::engine::SharedRow;
use crate::error::Result;
use crate::pass::{KernelShape, Update};
use crate::reference::Rules;
use crate::reference::exposure::{ExposureRows, backward, exposed};
use crate::reference::loss::photo_loss;
use crate::scheduler::plan::Buf;
use crate::shaders::constants::{EXPOSURE_PRIOR, EXPOSURE_ROWS};
use crate::train::shared::exposure::Exposure;
use crate::train::shared::{Place, SharedLayout, SharedParameters};
use std::ops::Range;
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
const OF_STEP: Range<usize> = OF_PHOTO..2 * OF_PHOTO;

/// Runs a step on a photo with some saturated pixels. Compares the gradients of the picture and of the rows of the photo;
/// the other photos have none.
pub(super) fn step(rig: &Rig) -> Result<Judge> {
    let shape = Shape { gaussians: 150, width: 61, height: 45, ..Shape::default() };
    let mut scene = scene(91, &shape);
    scene.target.photo.colours.iter_mut().step_by(5).for_each(|colour| *colour = [1.0; 3]);
    let options = (KernelShape { update: Update::Split, ..rig.kernels }, readable());
    let mut fixture = Fixture::with_room(Arc::clone(rig.gpu), scene, false, options, |room| {
        room.with_shared_rows(ROWS.len() as u32)
    })?;
    let pixels = fixture.pixels();
    // The picture of a step without exposure.
    fixture.train()?;
    let image = colours(&fixture.get(Buf::IMAGE, pixels)?);
    let place = Place { all: SharedLayout { scene: 0, photo: EXPOSURE_ROWS }, ..Place::default() };
    fixture.engine.set_extension(Exposure::default().extension(place), 1);
    fixture.engine.set_shared(&ROWS)?;
    fixture.shared = OF_STEP.map(|row| SharedRow { row: row as u32, rates: [0.0; 4] }).collect();
    fixture.train_with(1)?;
    let found_image = colours(&fixture.get(Buf::V_IMAGE, pixels)?);
    let found_rows = colours(&fixture.get(Buf::V_SHARED, ROWS.len())?);
    let photo = fixture.scene.target.photo;
    Ok(Box::new(move |rules: &Rules| {
        let of_photo = |photo: usize| -> ExposureRows {
            std::array::from_fn(|row| [0, 1, 2].map(|c| f64::from(ROWS[OF_PHOTO * photo + row][c])))
        };
        let rows = of_photo(1);
        let loss = photo_loss(rules, &exposed(&image, &rows), &photo);
        if loss.margin() < 1e-6 {
            return Err(format!("a pixel of this seed is too close to the kink of the loss: {}", loss.margin()));
        }
        let photos = ROWS.len() / OF_PHOTO;
        let sum = |row: usize, c: usize| (0..photos).map(|photo| of_photo(photo)[row][c]).sum::<f64>();
        let mean = std::array::from_fn(|row| [0, 1, 2].map(|c| sum(row, c) / photos as f64));
        let prior = (f64::from(EXPOSURE_PRIOR), &mean);
        let (v_image, v_rows) = backward(&image, &rows, (&loss.v_image, &photo.colours), prior);
        // As for the photo loss, times a gain of up to 2.5.
        let of_image = gradients(found_image.as_flattened(), v_image.as_flattened(), bounds(2.8e-6, 4.6e-6));
        let mut expected = vec![[0.0; 3]; ROWS.len()];
        expected[OF_STEP].copy_from_slice(&v_rows);
        // Sums of 2,745 products of either sign, each with the relative error of its gradient.
        let tolerance = Tolerance { absolute: 1e-6, relative: 1e-6 }.times(LEEWAY);
        judge::all([of_image, close(found_rows.as_flattened(), expected.as_flattened(), tolerance)])
    }))
}
