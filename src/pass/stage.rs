//! Stages and names of the items of a list, for reports.

use crate::scheduler::plan::{PassList, Stage, TABLE, Work};

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
    use crate::pass::{KernelShape, Supervision, Variant, training_step};
    use crate::scheduler::plan::{Capacity, Stage};

    #[test]
    fn every_item_of_a_step_has_its_stage() {
        let (shape, capacity) = (KernelShape::new(8, true), Capacity { virtual_tiles: 100, ..Capacity::default() });
        let variant = Variant { supervision: Supervision::Layers { lift: true }, ..Variant::plain((64, 48)) };
        let named = stages(&training_step(&shape, &capacity, variant));
        for stage in Stage::ALL {
            assert!(named.iter().any(|(found, _)| *found == stage), "{stage:?} is empty");
        }
        let of = |name: &str| named.iter().find(|(_, found)| found == name).map(|(stage, _)| *stage);
        assert_eq!(of("radix_scan by depth"), Some(Stage::Sort));
        assert_eq!(of("radix_scan by tile"), Some(Stage::Sort));
        assert_eq!(of("layer_list"), Some(Stage::Tile));
        assert_eq!(of("scan_reduce_flag"), Some(Stage::Project));
        assert_eq!(named.last().map(|(stage, _)| *stage), Some(Stage::Report));
        // A step never returns to an earlier stage, except for its two sorts and two projections.
        let mut order: Vec<Stage> = named.iter().map(|(stage, _)| *stage).collect();
        order.dedup();
        let expected = [
            Stage::Project,
            Stage::Sort,
            Stage::Project,
            Stage::Tile,
            Stage::Sort,
            Stage::Tile,
            Stage::BlendForward,
            Stage::Loss,
            Stage::BlendBackward,
            Stage::Gather,
            Stage::ProjectBackward,
            Stage::Optimise,
            Stage::Labels,
            Stage::Report,
        ];
        assert_eq!(order, expected);
    }
}
