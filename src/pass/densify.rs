//! Clones, splits and prunes on the device: marks and counts Gaussians, then rewrites the attributes in the new order.

use super::build::{Builder, Count, args, over_gaussians};
use super::optimize::MODEL_ATTRIBUTES;
use super::scan::{self, Total};
use crate::pass::build::pass;
use crate::scheduler::plan::{Buf, Stage};

/// Marks the Gaussians in the free space of the step's camera.
pub(crate) fn mark_near(b: &mut Builder) {
    b.list.stage = Stage::OPTIMISE;
    pass!(b, mark_near {} [], over_gaussians());
}

/// Decides the fate of each Gaussian and counts the result.
pub(super) fn mark(b: &mut Builder) {
    b.list.stage = Stage::OPTIMISE;
    pass!(b, densify_mark {} [], over_gaussians());
    scan::scan(b, Buf::CHILDREN_COUNTS, Buf::CHILD_OFFSETS, Count::Gaussians, Total::Densified);
}

/// Weighs the Gaussians for [`relocate`], and counts those to be removed.
pub(super) fn weigh(b: &mut Builder) {
    b.list.stage = Stage::OPTIMISE;
    pass!(b, relocate_weigh {} [], over_gaussians());
    scan::scan(b, Buf::CHILDREN_COUNTS, Buf::CHILD_OFFSETS, Count::Gaussians, Total::Densified);
}

/// Draws Gaussians and decides how many copies each gets.
pub(super) fn relocate(b: &mut Builder) {
    weigh(b);
    pass!(b, relocate_draw {} [], over_gaussians());
    scan::scan(b, Buf::CHILDREN_COUNTS, Buf::CHILD_OFFSETS, Count::Gaussians, Total::Densified);
}

/// Rewrites the model, and its labels if `labels`; needs [`mark`] or [`relocate`] earlier in the same list.
pub(super) fn apply(b: &mut Builder, labels: bool) {
    b.list.copy(Buf::MEANS, Buf::OLD_MEANS, 0);
    b.list.copy(Buf::SCALES, Buf::OLD_SCALES, 0);
    b.list.copy(Buf::QUATS, Buf::OLD_QUATS, 0);
    pass!(b, densify_geometry {} [], over_gaussians());
    for a in &MODEL_ATTRIBUTES {
        let geometry = [Buf::MEANS, Buf::SCALES, Buf::QUATS].contains(&a.planes[0]);
        let moments = a.moments(b.half).iter().map(|&plane| (plane, true));
        let planes = [(a.planes[0], false)].into_iter().skip(usize::from(geometry)).chain(moments);
        for (plane, are_moments) in planes {
            b.list.copy(plane, Buf::OLD_VALUES, 0);
            pass!(b, densify_copy(half: b.half && are_moments) { values: plane }
                [stride: a.stride, moments: u32::from(are_moments)], args(a.args));
        }
    }
    if labels {
        b.list.copy(Buf::LABELS, Buf::OLD_LABELS, 0);
        pass!(b, densify_labels {} [], over_gaussians());
    }
    b.list.fill(Buf::DENSIFY_STATS, 0);
}
