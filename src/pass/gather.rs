//! Sums the gradient records of each splat without atomics, so that every run gives the same bits.

use super::build::{Builder, over_splats};
use super::project::GAUSSIAN_FROM_SPLAT;
use crate::pass::build::pass;
use crate::scheduler::plan::Stage;

/// Sums the records and updates the densification statistic.
pub(super) fn gather(b: &mut Builder) {
    b.list.stage = Stage::GATHER;
    pass!(b, gather(labels: b.supervision.has_layers(), group: b.shape.group_walks)
        { gaussian_from_splat: GAUSSIAN_FROM_SPLAT } [], over_splats());
}

/// Adds the blending weights of the view to those of the Gaussians, if every pixel has a gradient of 1.
pub(super) fn weigh(b: &mut Builder) {
    b.list.stage = Stage::GATHER;
    pass!(b, weigh { gaussian_from_splat: GAUSSIAN_FROM_SPLAT } [], over_splats());
}
