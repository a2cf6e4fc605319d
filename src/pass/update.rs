//! Updates the Gaussians that a step touched in one kernel. All others miss the update, and catch up when something
//! touches or reads them.

use super::build::{Builder, over_gaussians};
use super::shape::Update;
use super::{Extension, KernelShape, project};
use crate::pass::build::pass;
use crate::scheduler::plan::Stage;

/// Returns true if one kernel does a step's update, or only its statistic, because no extension interferes.
pub(crate) fn is_fused(shape: &KernelShape, (extension, passes): (&dyn Extension, u32)) -> bool {
    shape.update == Update::Lazy && !extension.splits_update(passes) && extension.updates_unseen(passes)
}

/// Sums the gradient records of the visible trained Gaussians. With `changes`, it also updates those with a gradient.
pub(super) fn update(b: &mut Builder, changes: bool) {
    let (sh_degree, modes) = (b.sh_degree, if changes { b.update_modes } else { 0 });
    b.list.stage = Stage::OPTIMISE;
    pass!(b, update(labels: b.supervision.has_layers(), half: b.half, poses: b.pose.is_some()) { pose_partials: project::POSE_PARTIALS } [sh_degree: sh_degree, changes: u32::from(changes), modes: modes], over_gaussians());
    if let Some(row) = b.pose {
        project::pose_reduce(b, row, false);
    }
}

/// Gives all Gaussians the updates that they have missed.
pub(super) fn catch_up(b: &mut Builder) {
    let sh_degree = b.sh_degree;
    pass!(b, catch_up(half: b.half) {} [sh_degree: sh_degree], over_gaussians());
}
