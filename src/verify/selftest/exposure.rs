//! Compares a step with an exposure of its photo with the reference.

use super::checks::{bounds, colours};
use super::compare::{Tolerance, close, gradients};
use super::fixture::{Fixture, readable};
use super::scenes::{Shape, scene};
use super::{ERROR_FACTOR, Judge, Rig, judge};
use crate::engine::SharedRow;
use crate::error::Result;
use crate::pass::{KernelShape, Update};
use crate::reference::Rules;
use crate::reference::exposure::{ExposureRows, backward, exposed};
use crate::reference::loss::photo_loss;
use crate::scheduler::plan::Buf;
use crate::shaders::constants::{EXPOSURE_PRIOR, EXPOSURE_ROWS};
use crate::train::shared::exposure::Exposure;
use crate::train::shared::{RowOffsets, SharedLayout, SharedParameters};
use std::ops::Range;
use std::sync::Arc;

/// Rows of three photos; the step uses the second one, with some channels above 1.
const PHOTO_ROWS: [[f32; 4]; 9] = [
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
const ROWS_PER_PHOTO: usize = EXPOSURE_ROWS as usize;
const STEP_ROWS: Range<usize> = ROWS_PER_PHOTO..2 * ROWS_PER_PHOTO;

/// Runs a step on a photo with some saturated pixels. Compares the gradients of the picture and of the photo's rows;
/// other photos have no gradient.
pub(super) fn step(rig: &Rig) -> Result<Judge> {
    let shape = Shape { gaussians: 150, width: 61, height: 45, ..Shape::default() };
    let mut scene = scene(91, &shape);
    scene.target.photo.colours.iter_mut().step_by(5).for_each(|colour| *colour = [1.0; 3]);
    let options = (KernelShape { update: Update::Split, ..rig.kernels }, readable());
    let mut fixture = Fixture::with_room(Arc::clone(rig.gpu), scene, false, options, |room| {
        room.with_shared_rows(PHOTO_ROWS.len() as u32)
    })?;
    let pixels = fixture.pixels();
    // The picture of a step without exposure.
    fixture.train()?;
    let image = colours(&fixture.get(Buf::IMAGE, pixels)?);
    let place = RowOffsets { all: SharedLayout { scene: 0, photo: EXPOSURE_ROWS }, ..RowOffsets::default() };
    fixture.engine.set_extension(Exposure::default().extension(place), 1);
    fixture.engine.set_shared(&PHOTO_ROWS)?;
    fixture.shared = STEP_ROWS.map(|row| SharedRow { row: row as u32, rates: [0.0; 4] }).collect();
    fixture.train_with(1)?;
    let found_image = colours(&fixture.get(Buf::V_IMAGE, pixels)?);
    let found_rows = colours(&fixture.get(Buf::V_SHARED, PHOTO_ROWS.len())?);
    let photo = fixture.scene.target.photo;
    Ok(Box::new(move |rules: &Rules| {
        let of_photo = |photo: usize| -> ExposureRows {
            std::array::from_fn(|row| [0, 1, 2].map(|c| f64::from(PHOTO_ROWS[ROWS_PER_PHOTO * photo + row][c])))
        };
        let rows = of_photo(1);
        let loss = photo_loss(rules, &exposed(&image, &rows), &photo);
        if loss.margin() < 1e-6 {
            return Err(format!("a pixel of this seed is too close to the loss's kink: {}", loss.margin()));
        }
        let photos = PHOTO_ROWS.len() / ROWS_PER_PHOTO;
        let sum = |row: usize, c: usize| (0..photos).map(|photo| of_photo(photo)[row][c]).sum::<f64>();
        let mean = std::array::from_fn(|row| [0, 1, 2].map(|c| sum(row, c) / photos as f64));
        let prior = (f64::from(EXPOSURE_PRIOR), &mean);
        let (v_image, v_rows) = backward(&image, &rows, (&loss.v_image, &photo.colours), prior);
        // As for the photo loss, times a gain of up to 2.5.
        let of_image = gradients(found_image.as_flattened(), v_image.as_flattened(), bounds(2.8e-6, 4.6e-6));
        let mut expected = vec![[0.0; 3]; PHOTO_ROWS.len()];
        expected[STEP_ROWS].copy_from_slice(&v_rows);
        // Sums of 2,745 products of either sign, each with the relative error of its gradient.
        let tolerance = Tolerance { absolute: 1e-6, relative: 1e-6 }.times(ERROR_FACTOR);
        judge::combine([of_image, close(found_rows.as_flattened(), expected.as_flattened(), tolerance)])
    }))
}
