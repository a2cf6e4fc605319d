//! Searches a training's state for values that are not finite.

use super::build::Builder;
use crate::pass::buffers::TABLE;
use crate::pass::build::pass;
use crate::scheduler::plan::{Buf, Domain, Grid, Stage};
use crate::shaders::constants::{FINITE_GROUPS, NO_ROW};

/// Writes the first row with a NaN or infinity of each float plane, in plane order.
pub(super) fn find_nonfinite(b: &mut Builder, planes: &[Buf]) {
    b.list.stage = Stage::OPTIMISE;
    b.list.fill(Buf::NONFINITE_ROWS, NO_ROW);
    for (index, &plane) in planes.iter().enumerate() {
        let decl = &TABLE[plane.index()];
        let is_of = |domain: Domain| decl.domain.count == domain.count;
        let rows_fixed = if is_of(Domain::SHARED_ROWS) { b.capacity.shared_rows as u32 } else { 0 };
        pass!(b, find_nonfinite { plane: plane }
            [count_source: u32::from(decl.domain.is_trained()), plane: index as u32, row_words: decl.element_bytes / 4,
                rows_fixed: rows_fixed], Grid::Groups(FINITE_GROUPS, 1, 1));
    }
}
