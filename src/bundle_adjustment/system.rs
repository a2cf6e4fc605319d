//! The equations of all poses, and their solution.

use super::Frame;
use super::pair::{COMPARISON_PARAMETERS, CameraTransform, Comparison, POSE_PARAMETERS, compare};
use super::patch::Patch;
use rayon::prelude::*;

/// Share of the diagonal that is added to the pose equations, because position, rotation and scale of the whole are
/// undetermined.
const POSE_DAMPING: f64 = 1e-7;
/// The same for depths.
const DEPTH_DAMPING: f64 = 1e-3;
/// Largest step of the logarithm of a depth.
const DEPTH_STEP_MAX: f64 = 0.02;
/// Fewest matrix rows that are worth another thread.
const ROWS_MIN: usize = 64;

/// Comparison counts of a frame.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Counts {
    /// Comparisons with frames that show the patch, judged by depth.
    pub(super) compared: usize,
    /// Comparisons that match.
    pub(super) matching: usize,
}

impl std::ops::Add for Counts {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self { compared: self.compared + other.compared, matching: self.matching + other.matching }
    }
}

/// The equations of a patch's depth.
#[derive(Clone, Debug)]
struct DepthEquation {
    /// Second derivative.
    curvature: f64,
    /// Negative first derivative.
    pull: f64,
    /// Mixed derivatives with poses: index of the frame among host and partners, and six parameters.
    mixed: Vec<(usize, [f64; POSE_PARAMETERS])>,
}

/// The equations of one frame's patches, in the poses of the frame and its partners, in this order. Depths are
/// eliminated.
#[derive(Clone, Debug)]
pub(super) struct FrameEquations {
    /// Row-major.
    matrix: Vec<f64>,
    right: Vec<f64>,
    /// Comparisons of each frame.
    counts: Vec<Counts>,
    depths: Vec<DepthEquation>,
}

/// Returns the equations of the patches of each frame.
pub(super) fn sums(frames: &[Frame], patches: &[Vec<Patch>], partners: &[Vec<usize>]) -> Vec<FrameEquations> {
    let of = |host: usize| {
        let ways: Vec<CameraTransform> = partners[host]
            .iter()
            .map(|&other| CameraTransform::new(&frames[host].camera, &frames[other].camera))
            .collect();
        let mut sums = FrameEquations::new(1 + ways.len());
        for patch in &patches[host] {
            let each =
                ways.iter().zip(&partners[host]).map(|(transform, &other)| compare(transform, patch, &frames[other]));
            sums.add(each);
        }
        sums
    };
    (0..frames.len()).into_par_iter().map(of).collect()
}

/// Returns the pose steps of a frame and its partners.
pub(super) fn steps_of(
    host: usize,
    partners: &[usize],
    steps: &[[f64; POSE_PARAMETERS]],
) -> Vec<[f64; POSE_PARAMETERS]> {
    std::iter::once(&host).chain(partners).map(|&frame| steps[frame]).collect()
}

impl FrameEquations {
    fn new(frames: usize) -> Self {
        let side = POSE_PARAMETERS * frames;
        Self {
            matrix: vec![0.0; side * side],
            right: vec![0.0; side],
            counts: vec![Counts::default(); frames],
            depths: Vec::new(),
        }
    }

    /// Adds a patch, given its comparison with each partner.
    fn add(&mut self, each: impl Iterator<Item = Option<Option<Comparison>>>) {
        let mut own = [0.0; POSE_PARAMETERS];
        let mut depth = DepthEquation { curvature: 0.0, pull: 0.0, mixed: Vec::new() };
        for (partner, compared) in each.enumerate().filter_map(|(k, compared)| Some((k + 1, compared?))) {
            for frame in [0, partner] {
                let counts = &mut self.counts[frame];
                *counts = *counts + Counts { compared: 1, matching: compared.is_some().into() };
            }
            let Some(compared) = compared else { continue };
            let (matrix, right) = products(&compared);
            for i in 0..2 * POSE_PARAMETERS {
                let row = index(partner, i);
                self.right[row] += right[i];
                for j in 0..2 * POSE_PARAMETERS {
                    self.matrix[row * self.right.len() + index(partner, j)] += matrix[i][j];
                }
            }
            let mixed = matrix[COMPARISON_PARAMETERS - 1];
            depth.curvature += mixed[COMPARISON_PARAMETERS - 1];
            depth.pull += right[COMPARISON_PARAMETERS - 1];
            depth.mixed.push((partner, std::array::from_fn(|k| mixed[k])));
            own.iter_mut().zip(&mixed[POSE_PARAMETERS..]).for_each(|(sum, mixed)| *sum += mixed);
        }
        depth.mixed.push((0, own));
        depth.curvature *= 1.0 + DEPTH_DAMPING;
        if depth.curvature > 0.0 {
            self.eliminate(&depth);
        }
        self.depths.push(depth);
    }

    fn eliminate(&mut self, depth: &DepthEquation) {
        let side = self.right.len();
        for (a, by_a) in &depth.mixed {
            for i in 0..POSE_PARAMETERS {
                let (row, share) = (POSE_PARAMETERS * a + i, by_a[i] / depth.curvature);
                self.right[row] -= share * depth.pull;
                for (b, by_b) in &depth.mixed {
                    let at = row * side + POSE_PARAMETERS * b;
                    self.matrix[at..at + POSE_PARAMETERS]
                        .iter_mut()
                        .zip(by_b)
                        .for_each(|(sum, by_b)| *sum -= share * by_b);
                }
            }
        }
    }

    /// Updates the patch depths after the pose steps of the frame and its partners.
    pub(super) fn move_depths(&self, patches: &mut [Patch], steps: &[[f64; POSE_PARAMETERS]]) {
        for (patch, depth) in patches.iter_mut().zip(&self.depths).filter(|(_, depth)| depth.curvature > 0.0) {
            let by_poses: f64 = depth.mixed.iter().map(|(frame, by)| dot(by, &steps[*frame])).sum();
            let step = ((depth.pull - by_poses) / depth.curvature).clamp(-DEPTH_STEP_MAX, DEPTH_STEP_MAX);
            patch.places.iter_mut().for_each(|place| *place *= step.exp());
        }
    }
}

/// Returns the index in [`FrameEquations`] of a parameter of a comparison with a partner.
fn index(partner: usize, number: usize) -> usize {
    if number < POSE_PARAMETERS { POSE_PARAMETERS * partner + number } else { number - POSE_PARAMETERS }
}

/// Returns the matrix and the right-hand side of a comparison.
fn products(
    compared: &Comparison,
) -> ([[f64; COMPARISON_PARAMETERS]; COMPARISON_PARAMETERS], [f64; COMPARISON_PARAMETERS]) {
    let ([xx, xy, yy], [x, y]) = (compared.moments, compared.places);
    let matrix = std::array::from_fn(|i| {
        let (by_x, by_y) = (xx * x[i] + xy * y[i], xy * x[i] + yy * y[i]);
        std::array::from_fn(|j| by_x * x[j] + by_y * y[j])
    });
    (matrix, std::array::from_fn(|i| compared.pull[0] * x[i] + compared.pull[1] * y[i]))
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The equations of all frames.
#[derive(Clone, Debug)]
pub(super) struct System {
    /// Row-major, symmetric.
    matrix: Vec<f64>,
    right: Vec<f64>,
    /// Comparisons of each frame.
    pub(super) counts: Vec<Counts>,
}

impl System {
    pub(super) fn from_frame_equations(sums: &[FrameEquations], partners: &[Vec<usize>], frames: usize) -> Self {
        let side = POSE_PARAMETERS * frames;
        let mut all =
            Self { matrix: vec![0.0; side * side], right: vec![0.0; side], counts: vec![Counts::default(); frames] };
        for (host, (sums, partners)) in sums.iter().zip(partners).enumerate() {
            let of: Vec<usize> = std::iter::once(host).chain(partners.iter().copied()).collect();
            let row = |local: usize| POSE_PARAMETERS * of[local / POSE_PARAMETERS] + local % POSE_PARAMETERS;
            for (i, right) in sums.right.iter().enumerate() {
                all.right[row(i)] += right;
                for j in 0..sums.right.len() {
                    all.matrix[row(i) * side + row(j)] += sums.matrix[i * sums.right.len() + j];
                }
            }
            of.iter().zip(&sums.counts).for_each(|(&frame, &counts)| all.counts[frame] = all.counts[frame] + counts);
        }
        all
    }

    /// Returns the step of each frame, 0 for frames that are not constrained; `None` if the equations have no solution.
    pub(super) fn solved(mut self, is_told: &[bool]) -> Option<Vec<[f64; POSE_PARAMETERS]>> {
        let side = self.right.len();
        for row in 0..side {
            for column in 0..side {
                if !is_told[row / POSE_PARAMETERS] || !is_told[column / POSE_PARAMETERS] {
                    self.matrix[row * side + column] = if row == column { 1.0 } else { 0.0 };
                }
            }
            if is_told[row / POSE_PARAMETERS] {
                self.matrix[row * side + row] *= 1.0 + POSE_DAMPING;
            } else {
                self.right[row] = 0.0;
            }
        }
        solve(&mut self.matrix, &mut self.right)?;
        Some(self.right.as_chunks().0.to_vec())
    }
}

/// Solves symmetric positive equations (Cholesky). The matrix is replaced by the lower factor, the right-hand side by
/// the solution. `None` if there is no solution.
pub(crate) fn solve(matrix: &mut [f64], right: &mut [f64]) -> Option<()> {
    let side = right.len();
    for column in 0..side {
        let (above, below) = matrix.split_at_mut((column + 1) * side);
        let pivot = &mut above[column * side..];
        let square = pivot[column] - dot(&pivot[..column], &pivot[..column]);
        if square.is_nan() || square <= 0.0 {
            return None;
        }
        pivot[column] = square.sqrt();
        let pivot = &*pivot;
        below.par_chunks_mut(side).with_min_len(ROWS_MIN).for_each(|row| {
            row[column] = (row[column] - dot(&row[..column], &pivot[..column])) / pivot[column];
        });
    }
    for row in 0..side {
        right[row] =
            (right[row] - dot(&matrix[row * side..row * side + row], &right[..row])) / matrix[row * side + row];
    }
    for row in (0..side).rev() {
        right[row] /= matrix[row * side + row];
        for column in 0..row {
            right[column] -= matrix[row * side + column] * right[row];
        }
    }
    right.iter().all(|value| value.is_finite()).then_some(())
}
