//! Pose correction of each photo, trained together with the Gaussians.
//!
//! Poses of a reconstruction may be off by pixels, which blurs the model. The step's camera is rotated and translated
//! by the photo's correction. The photos do not determine position and rotation of the whole, and hardly constrain slow
//! bends of a camera path; a weak pull to 0 stabilises both. Each photo has six trained numbers, which its
//! preconditioner converts to a pose.

use super::preconditioner::{self, Matrix};
use super::{RowOffsets, SharedLayout, SharedParameters};
use crate::bundle_adjustment;
use crate::pass::{Builder, Extension, Hook, project};
use crate::scene::{Camera, Dataset, Point, View};
use crate::train::strategy::StepContext;
use glam::{DQuat, DVec3};
use std::sync::Arc;

/// Name of the parameters.
pub(in crate::train) const POSES_NAME: &str = "poses";
/// Rows per photo (glsl/include/pose.glsl): two of trained numbers, twelve of the preconditioner.
pub(crate) const ROWS_PER_PHOTO: usize = 14;
/// Initial learning rate: movement of points in the photo, in focal lengths. The some dozens of updates per photo in a
/// short run can reach a degree and a fiftieth of the depth. The rate falls to the share [`LEARNING_RATE_FALL`] of
/// itself.
const LEARNING_RATE_START: f64 = 2e-3;
const LEARNING_RATE_FALL: f64 = 0.02;
/// Share of the run before the first update: earlier, Gaussians have no useful colours.
const FIRST_UPDATE_SHARE: f64 = 0.08;
/// Shares of the run after which photos are compared with each other. Poses settled this way get no more gradients.
const COMPARISON_SHARES: [f64; 3] = [0.2, 0.35, 0.5];

/// Pose corrections, initially 0.
#[derive(Clone, Debug, Default)]
pub struct Poses {
    /// Depth of the scene and preconditioner of each view.
    of_views: Vec<(f32, Matrix)>,
}

impl Poses {
    /// Makes the parameters of a scene.
    pub fn new(dataset: &Dataset) -> Self {
        let depth = |view: &View| {
            let seen = |point: &&Point| view.camera.sees(point.position).is_some();
            let depth = |point: &Point| view.camera.to_camera(point.position).z;
            let mut depths: Vec<f64> = dataset.points.iter().filter(seen).map(depth).collect();
            depths.sort_by(f64::total_cmp);
            depths.get(depths.len() / 2).copied().unwrap_or(dataset.extent()) as f32
        };
        let of_view = |view: &View| {
            let depth = depth(view);
            (depth, preconditioner::view_preconditioner(&view.camera, &dataset.points, depth.into()))
        };
        Self { of_views: dataset.train.iter().map(of_view).collect() }
    }
}

/// Returns true if a comparison of all photos settles poses before this step.
pub(in crate::train) fn are_compared_before(at: StepContext) -> bool {
    let after = |share: f64| (share * f64::from(at.config.iterations)).round() as u32 + 1;
    COMPARISON_SHARES.iter().any(|&share| at.step == after(share))
}

/// Returns a camera corrected by its rows (glsl/include/pose.glsl).
pub(crate) fn corrected(camera: &Camera, rows: &[[f32; 4]]) -> Camera {
    let three = |row: usize| DVec3::new(rows[row][0].into(), rows[row][1].into(), rows[row][2].into());
    let of = |k: usize| three(2 * k + 2).dot(three(0)) + three(2 * k + 3).dot(three(1));
    let (turn, shift) = (DVec3::new(of(0), of(1), of(2)), DVec3::new(of(3), of(4), of(5)));
    camera.corrected(turn, camera.rotation.transpose() * (f64::from(rows[1][3]) * shift))
}

/// Settles a photo's pose: sets its rows so that the corrected camera is `to`. `None` if no rows give this camera.
pub(in crate::train) fn settle(rows: &mut [[f32; 4]], from: &Camera, to: &Camera) -> Option<()> {
    let turn = DQuat::from_mat3(&(to.rotation * from.rotation.transpose()));
    let turn = 2.0 / turn.w * turn.xyz();
    let shift = from.rotation * (to.centre() - from.centre()) / f64::from(rows[1][3]);
    let mut numbers = [turn.x, turn.y, turn.z, shift.x, shift.y, shift.z];
    let mut matrix: Vec<f64> =
        rows[2..ROWS_PER_PHOTO].iter().flat_map(|row| [row[0], row[1], row[2]].map(f64::from)).collect();
    bundle_adjustment::solve(&mut matrix, &mut numbers)?;
    for (row, three) in rows.iter_mut().zip(numbers.chunks_exact(3)) {
        row[..3].iter_mut().zip(three).for_each(|(to, &number)| *to = number as f32);
    }
    rows[0][3] = 1.0;
    Some(())
}

impl SharedParameters for Poses {
    fn name(&self) -> &'static str {
        POSES_NAME
    }

    fn layout(&self) -> SharedLayout {
        SharedLayout { scene: 0, photo: ROWS_PER_PHOTO as u32 }
    }

    fn start(&self, view: Option<usize>) -> Vec<[f32; 4]> {
        let Some((depth, matrix)) = view.map(|view| &self.of_views[view]) else { return Vec::new() };
        let numbers = matrix.as_flattened().chunks_exact(3);
        let matrix = numbers.map(|of| [of[0] as f32, of[1] as f32, of[2] as f32, 0.0]);
        [[0.0; 4], [0.0, 0.0, 0.0, *depth]].into_iter().chain(matrix).collect()
    }

    fn rates(&self, at: StepContext) -> Vec<[f32; 4]> {
        let part = f64::from(at.step) / f64::from(at.config.iterations);
        let rate =
            if part > FIRST_UPDATE_SHARE { (LEARNING_RATE_START * LEARNING_RATE_FALL.powf(part)) as f32 } else { 0.0 };
        let mut rates = vec![[0.0; 4]; ROWS_PER_PHOTO];
        rates[..2].fill([rate, rate, rate, 0.0]);
        rates
    }

    fn extension(&self, place: RowOffsets) -> Arc<dyn Extension> {
        Arc::new(PosePasses(place))
    }
}

#[derive(Debug)]
struct PosePasses(RowOffsets);

impl Extension for PosePasses {
    fn extend(&self, _passes: u32, hook: Hook, b: &mut Builder) {
        match hook {
            Hook::Camera => project::pose(b, self.0.photo),
            Hook::Gradients => project::pose_backward(b, self.0.photo),
            Hook::Picture | Hook::Loss | Hook::Updated => {}
        }
    }

    fn splits_update(&self, _passes: u32) -> bool {
        false
    }
}

#[cfg(test)]
mod tests {
    use super::{Poses, ROWS_PER_PHOTO, corrected, settle};
    use crate::scene::{Camera, Point};
    use crate::train::shared::SharedParameters;
    use glam::{DMat3, DVec3};

    /// A settled pose equals the given one, with a preconditioner that mixes all numbers.
    #[test]
    fn a_settled_pose_is_the_one_found() {
        let (rotation, translation) = (DMat3::from_rotation_y(0.3), DVec3::new(0.1, -0.2, 5.0));
        let camera = Camera { rotation, translation, fx: 90.0, fy: 90.0, cx: 50.0, cy: 40.0, width: 100, height: 80 };
        let place = |k: usize| DVec3::new((k % 5) as f64 - 2.0, (k % 7) as f64 * 0.5 - 1.5, (k % 3) as f64 * 0.8);
        let points: Vec<Point> = (0..60).map(|k| Point { position: place(k), colour: [0; 3] }).collect();
        let matrix = crate::train::shared::preconditioner::view_preconditioner(&camera, &points, 4.0);
        let poses = Poses { of_views: vec![(4.0, matrix)] };
        let mut rows = poses.start(Some(0));
        assert_eq!((rows.len(), rows[0][3]), (ROWS_PER_PHOTO, 0.0));
        let to = camera.corrected(DVec3::new(0.02, -0.01, 0.03), DVec3::new(0.05, 0.1, -0.04));
        settle(&mut rows, &camera, &to).expect("rows");
        let found = corrected(&camera, &rows);
        assert!(found.centre().distance(to.centre()) < 1e-5, "{} and {}", found.centre(), to.centre());
        assert!(found.axis().distance(to.axis()) < 1e-5 && found.rotation.row(0).distance(to.rotation.row(0)) < 1e-5);
        assert_eq!(rows[0][3], 1.0, "gets no more gradients");
    }
}
