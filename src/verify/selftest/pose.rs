//! Compares a step with a corrected photo pose with the reference.

use super::compare::{Tolerance, close};
use super::fixture::{Fixture, readable};
use super::scenes::{Scene, Shape, scene};
use super::{ERROR_FACTOR, Judge, judge};
use crate::engine::{EngineSize, SharedRow};
use crate::error::Result;
use crate::gpu::Gpu;
use crate::pass::{KernelShape, Update};
use crate::reference::pose::{PoseRows, backward, corrected};
use crate::reference::{Row, Rules};
use crate::scheduler::plan::Buf;
use crate::shaders::constants::POSE_PRIOR;
use crate::train::shared::poses::{self, Poses};
use crate::train::shared::{RowOffsets, SharedLayout, SharedParameters};
use glam::DVec3;
use std::sync::Arc;

/// The trained numbers of two photos; the step uses the second one, whose pose is a quarter settled. The last number is
/// the unit of translation.
const TRAINED_NUMBERS: [[[f32; 4]; 2]; 2] =
    [[[0.1, 0.2, 0.3, 0.0], [0.1, 0.0, 0.0, 2.0]], [[0.06, -0.11, 0.08, 0.25], [-0.02, 0.03, 0.05, 2.0]]];
const STEP_PHOTO_ROW: usize = poses::ROWS_PER_PHOTO;

/// Returns the rows of both photos, with preconditioners that mix all numbers.
fn rows() -> Vec<[f32; 4]> {
    let mixed = |k: usize| if k.is_multiple_of(7) { 1.1 } else { 0.02 * (k % 5) as f32 - 0.03 };
    let matrix = (0..12).map(|row| [mixed(3 * row), mixed(3 * row + 1), mixed(3 * row + 2), 0.0]);
    TRAINED_NUMBERS.iter().flat_map(|numbers| numbers.iter().copied().chain(matrix.clone())).collect()
}

/// Runs a step on a photo whose pose is corrected. Compares the splats of the corrected camera and the gradient of the
/// correction, by the shape's own update; the other photo has no gradient.
pub fn step(gpu: &Arc<Gpu>, kernels: KernelShape) -> Result<Judge> {
    let shape = Shape { gaussians: 150, width: 61, height: 45, ..Shape::default() };
    let (scene, rows) = (Scene { frozen: 40, ..scene(92, &shape) }, rows());
    let run = |update| -> Result<(Fixture, Vec<[f32; 4]>)> {
        let options = (KernelShape { update, ..kernels }, readable());
        let with = |room: EngineSize| room.with_shared_rows(rows.len() as u32);
        let mut fixture = Fixture::with_room(Arc::clone(gpu), scene.clone(), false, options, with)?;
        let all = SharedLayout { scene: 0, photo: STEP_PHOTO_ROW as u32 };
        fixture.engine.set_extension(Poses::default().extension(RowOffsets { all, ..RowOffsets::default() }), 1);
        fixture.engine.set_shared(&rows)?;
        let shared = (STEP_PHOTO_ROW..rows.len()).map(|row| SharedRow { row: row as u32, rates: [0.0; 4] });
        fixture.shared = shared.collect();
        fixture.train_with(1)?;
        let v_shared = fixture.get::<[f32; 4]>(Buf::V_SHARED, rows.len())?;
        Ok((fixture, v_shared))
    };
    let ((_, v_shared), (mut fixture, _)) = (run(kernels.update)?, run(Update::Split)?);
    let (splats, v_model) = (fixture.splats()?, fixture.gradient_rows()?);
    let (model, camera) = (fixture.model(), fixture.scene.camera);
    Ok(Box::new(move |rules: &Rules| {
        let of_step: PoseRows = std::array::from_fn(|k| rows[STEP_PHOTO_ROW + k].map(f64::from));
        let posed = corrected(&camera, &of_step);
        // As for the projection, and the rounding errors of the corrected pose.
        let tolerance = Tolerance { absolute: 6e-5 * ERROR_FACTOR, relative: 0.0 };
        let of_splats = judge::projection(rules, (&posed, &model), &splats, tolerance);
        let [v_turn, v_move] = backward(rules, &camera, &of_step, (&model, &v_model), f64::from(POSE_PRIOR));
        let mut expected = vec![[0.0; 4]; v_shared.len()];
        expected[STEP_PHOTO_ROW][..3].copy_from_slice(&v_turn);
        expected[STEP_PHOTO_ROW + 1][..3].copy_from_slice(&v_move);
        let found: Vec<f64> = v_shared.as_flattened().iter().map(|&value| f64::from(value)).collect();
        // Sums of terms that cancel: a few roundings of each.
        let size = |(row, v): (&Row, &Row)| {
            let distance = (DVec3::from(row.mean) - posed.centre()).length();
            DVec3::from(v.mean).length() * (distance + of_step[1][3]) + v.quat.iter().map(|of| of.abs()).sum::<f64>()
        };
        let terms: f64 = model.rows.iter().zip(&v_model).map(size).sum();
        let tolerance = Tolerance { absolute: 5e-7 * terms * ERROR_FACTOR, relative: 0.0 };
        judge::combine([of_splats, close(&found, expected.as_flattened(), tolerance)])
    }))
}
