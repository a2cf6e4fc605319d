//! Stages of a step, in the order of execution, and the stage and name of each item of a list, for reports.

use crate::pass::buffers::TABLE;
use crate::scheduler::plan::{PassList, Stage, Work};

impl Stage {
    /// Projection of Gaussians to splats.
    pub const PROJECT: Self = Self { order: 0, name: "project" };
    /// Both radix sorts.
    pub const SORT: Self = Self { order: 1, name: "sort" };
    /// Binning of splats into tile lists.
    pub const TILE: Self = Self { order: 2, name: "tile" };
    /// Forward blending; with labels also the label loss and the lift's votes.
    pub const BLEND_FORWARD: Self = Self { order: 3, name: "blend forward" };
    /// Photo loss and its gradient with respect to the picture.
    pub const LOSS: Self = Self { order: 4, name: "loss" };
    /// Backward blending: gradients of (splat, tile) pairs.
    pub const BLEND_BACKWARD: Self = Self { order: 5, name: "blend backward" };
    /// Sum of these gradients per splat.
    pub const GATHER: Self = Self { order: 6, name: "gather" };
    /// Gradients of the Gaussians.
    pub const PROJECT_BACKWARD: Self = Self { order: 7, name: "project backward" };
    /// Adam, resets and densification.
    pub const OPTIMISE: Self = Self { order: 8, name: "optimise" };
    /// Labels from votes.
    pub const LABELS: Self = Self { order: 9, name: "labels" };
    /// Counters for the host.
    pub const REPORT: Self = Self { order: 10, name: "report" };

    /// All stages.
    pub const ALL: [Self; 11] = [
        Self::PROJECT,
        Self::SORT,
        Self::TILE,
        Self::BLEND_FORWARD,
        Self::LOSS,
        Self::BLEND_BACKWARD,
        Self::GATHER,
        Self::PROJECT_BACKWARD,
        Self::OPTIMISE,
        Self::LABELS,
        Self::REPORT,
    ];
}

/// Stage and name of each item of a list.
pub fn stages(list: &PassList) -> Vec<(Stage, String)> {
    let named = list.work.iter().map(|work| match work {
        Work::Pass(pass) => (pass.stage, pass.title.clone()),
        Work::Fill { buf, stage, .. } => (*stage, format!("fill {}", TABLE[buf.index()].name)),
        Work::Copy { to, stage, .. } => (*stage, format!("copy to {}", TABLE[to.index()].name)),
    });
    named.collect()
}

#[cfg(test)]
mod tests {
    use super::stages;
    use crate::pass::buffers::Capacity;
    use crate::pass::{KernelShape, Supervision, Variant, training_step};
    use crate::scheduler::plan::Stage;

    #[test]
    fn every_item_of_a_step_has_its_stage() {
        let (shape, capacity) = (KernelShape::new(8, true), Capacity { virtual_tiles: 100, ..Capacity::default() });
        let variant = Variant { supervision: Supervision::Layers { lift: true }, ..Variant::plain((64, 48)) };
        let named = stages(&training_step(&shape, &capacity, variant));
        for stage in Stage::ALL {
            assert!(named.iter().any(|(found, _)| *found == stage), "{stage:?} is empty");
        }
        let of = |name: &str| named.iter().find(|(_, found)| found == name).map(|(stage, _)| *stage);
        assert_eq!(of("radix_scan by depth"), Some(Stage::SORT));
        assert_eq!(of("radix_scan by tile"), Some(Stage::SORT));
        assert_eq!(of("layer_list"), Some(Stage::TILE));
        assert_eq!(of("scan_reduce_flag"), Some(Stage::PROJECT));
        assert_eq!(named.last().map(|(stage, _)| *stage), Some(Stage::REPORT));
        // A step never returns to an earlier stage, except for its two sorts and two projections.
        let mut order: Vec<Stage> = named.iter().map(|(stage, _)| *stage).collect();
        order.dedup();
        let expected = [
            Stage::PROJECT,
            Stage::SORT,
            Stage::PROJECT,
            Stage::TILE,
            Stage::SORT,
            Stage::TILE,
            Stage::BLEND_FORWARD,
            Stage::LOSS,
            Stage::BLEND_BACKWARD,
            Stage::GATHER,
            Stage::PROJECT_BACKWARD,
            Stage::OPTIMISE,
            Stage::LABELS,
            Stage::REPORT,
        ];
        assert_eq!(order, expected);
    }
}
