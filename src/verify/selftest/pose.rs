//! A step with a corrected pose of its photo, against the mirrors.

use super::compare::{Tolerance, Verdict, close};
use super::fixture::{Fixture, readable};
use super::judge;
use super::scenes::{Scene, Shape, scene};
use crate::engine::SharedRow;
use crate::error::Result;
use crate::gpu::Gpu;
use crate::pass::KernelShape;
use crate::scene::Camera;
use crate::scheduler::plan::Buf;
use crate::shaders::constants::POSE_PRIOR;
use crate::train::shared::poses::{self, Poses};
use crate::train::shared::{Place, SharedLayout, SharedParameters};
use crate::verify::reference::pose::{PoseRows, backward, corrected};
use crate::verify::reference::project::project_forward;
use crate::verify::reference::splat::Splat;
use crate::verify::reference::{Row, Rules};
use glam::DVec3;
use std::sync::Arc;

/// The trained numbers of two photos; the step is on the second one, whose pose is settled by a quarter. The last is the unit
/// of moves.
const NUMBERS: [[[f32; 4]; 2]; 2] =
    [[[0.1, 0.2, 0.3, 0.0], [0.1, 0.0, 0.0, 2.0]], [[0.06, -0.11, 0.08, 0.25], [-0.02, 0.03, 0.05, 2.0]]];
const FIRST: usize = poses::ROWS;

/// The rows of both photos, with preconditioners that mix all numbers.
fn rows() -> Vec<[f32; 4]> {
    let mixed = |k: usize| if k.is_multiple_of(7) { 1.1 } else { 0.02 * (k % 5) as f32 - 0.03 };
    let matrix = (0..12).map(|row| [mixed(3 * row), mixed(3 * row + 1), mixed(3 * row + 2), 0.0]);
    NUMBERS.iter().flat_map(|numbers| numbers.iter().copied().chain(matrix.clone())).collect()
}

/// Those of the second photo.
fn of_step() -> PoseRows {
    std::array::from_fn(|k| rows()[FIRST + k].map(f64::from))
}

/// A finished step.
pub struct Posed {
    scene: Scene,
    camera: Camera,
    splats: Vec<Splat>,
    rows: Vec<Row>,
    v_shared: Vec<[f32; 4]>,
}

impl Posed {
    /// Runs a step on a photo whose pose is corrected.
    pub fn new(gpu: &Arc<Gpu>, kernels: KernelShape) -> Result<Self> {
        let shape = Shape { gaussians: 150, width: 61, height: 45, ..Shape::default() };
        let scene = scene(92, &shape);
        let (camera, rows) = (corrected(&scene.camera, &of_step()), rows());
        let mut fixture = Fixture::with_rows(Arc::clone(gpu), scene, false, (kernels, readable()), rows.len() as u32)?;
        let place = Place { all: SharedLayout { scene: 0, photo: FIRST as u32 }, ..Place::default() };
        fixture.engine.set_extension(Poses::default().extension(place), 1);
        fixture.engine.set_shared(&rows)?;
        fixture.shared = (FIRST..rows.len()).map(|row| SharedRow { row: row as u32, rates: [0.0; 4] }).collect();
        fixture.train_with(1)?;
        Ok(Self {
            camera,
            splats: fixture.splats()?,
            rows: fixture.gradient_rows()?,
            v_shared: fixture.get(Buf::V_SHARED, rows.len())?,
            scene: fixture.scene,
        })
    }

    /// Compares with the reference: the splats of the corrected camera, the gradient of the correction, and 0 for the other
    /// photo.
    pub fn verdict(&self, rules: &Rules, leeway: f64) -> Verdict {
        let model = self.scene.model();
        let expected = |s: &Splat| project_forward(rules, &self.camera, &model, s.gaussian).map_or(*s, |p| p.splat);
        let splats: Vec<Splat> = self.splats.iter().map(expected).collect();
        // As for the projection, and the rounding errors of the corrected pose.
        let of_splats = judge::splats(&self.splats, &splats, Tolerance { absolute: 6e-5 * leeway, relative: 0.0 });
        let rows = of_step();
        let [v_turn, v_move] = backward(rules, &self.scene.camera, &rows, (&model, &self.rows), f64::from(POSE_PRIOR));
        let mut found = vec![[0.0; 4]; self.v_shared.len()];
        found[FIRST][..3].copy_from_slice(&v_turn);
        found[FIRST + 1][..3].copy_from_slice(&v_move);
        let device: Vec<f64> = self.v_shared.as_flattened().iter().map(|&value| f64::from(value)).collect();
        // Sums of terms that cancel: a few roundings of each.
        let size = |(row, v): (&Row, &Row)| {
            let distance = (DVec3::from(row.mean) - self.camera.centre()).length();
            DVec3::from(v.mean).length() * (distance + rows[1][3]) + v.quat.iter().map(|of| of.abs()).sum::<f64>()
        };
        let terms: f64 = model.rows.iter().zip(&self.rows).map(size).sum();
        let tolerance = Tolerance { absolute: 5e-7 * terms * leeway, relative: 0.0 };
        judge::all([of_splats, close(&device, found.as_flattened(), tolerance)])
    }
}

/// Checks the camera and the gradient of a step with a corrected pose of its photo.
pub(super) fn pose_of_a_step(rules: &Rules, gpu: &Arc<Gpu>, kernels: KernelShape, leeway: f64) -> Result<Verdict> {
    Ok(Posed::new(gpu, kernels)?.verdict(rules, leeway))
}
