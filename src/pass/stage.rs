//! Which stage of a step a pass belongs to, for reports.

use crate::scheduler::plan::{Buf, PassList, TABLE, Work};

/// A stage of a training step, in the order of the step.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Stage {
    /// From Gaussians to splats.
    Project,
    /// Both radix sorts.
    Sort,
    /// Splats into lists of tiles.
    Tile,
    /// Blending; with labels also the label loss and the lift's votes.
    BlendForward,
    /// Photo loss and its gradient by the picture.
    Loss,
    /// Gradients of the tiles' splats.
    BlendBackward,
    /// Sum of these by splat.
    Gather,
    /// Gradients of the Gaussians.
    ProjectBackward,
    /// Adam.
    Optimise,
    /// Votes to labels.
    Labels,
    /// Counters for the host.
    Report,
}

impl Stage {
    /// All stages.
    pub const ALL: [Self; 11] = [
        Self::Project,
        Self::Sort,
        Self::Tile,
        Self::BlendForward,
        Self::Loss,
        Self::BlendBackward,
        Self::Gather,
        Self::ProjectBackward,
        Self::Optimise,
        Self::Labels,
        Self::Report,
    ];

    /// Name for tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Project => "project",
            Self::Sort => "sort",
            Self::Tile => "tile",
            Self::BlendForward => "blend forward",
            Self::Loss => "loss",
            Self::BlendBackward => "blend backward",
            Self::Gather => "gather",
            Self::ProjectBackward => "project backward",
            Self::Optimise => "optimise",
            Self::Labels => "labels",
            Self::Report => "report",
        }
    }
}

/// Stage and name of each item of a training step. The two sorts share their shaders, and are told apart by name.
pub fn stages(list: &PassList) -> Vec<(Stage, String)> {
    let mut now = Stage::Project;
    let mut projected = false;
    let mut named = Vec::new();
    for work in &list.work {
        let name = match work {
            Work::Pass(pass) => {
                let stem = pass.shader.stem;
                projected = !stem.starts_with("cull") && (projected || stem.starts_with("project_forward"));
                now = stage_of(stem, now);
                match (now, projected) {
                    (Stage::Sort, false) => format!("{stem} by depth"),
                    (Stage::Sort, true) => format!("{stem} by tile"),
                    _ => stem.to_owned(),
                }
            }
            Work::Fill { buf, .. } => {
                now = if now == Stage::Sort { Stage::Tile } else { now };
                format!("fill {}", TABLE[buf.index()].name)
            }
            Work::Copy { to, .. } => {
                now = if [Buf::REPORT, Buf::REPORT_FAILURE].contains(to) { Stage::Report } else { now };
                format!("copy to {}", TABLE[to.index()].name)
            }
        };
        named.push((now, name));
    }
    named
}

/// The stage of a shader; scans belong to the stage around them.
fn stage_of(stem: &str, now: Stage) -> Stage {
    const BY_PREFIX: &[(&str, Stage)] = &[
        ("step_begin", Stage::Project),
        #[cfg(feature = "lab")]
        ("next_object", Stage::Project),
        ("cull", Stage::Project),
        ("prepare_splats", Stage::Project),
        ("compact", Stage::Project),
        ("radix_", Stage::Sort),
        ("project_forward", Stage::Project),
        ("prepare_instances", Stage::Tile),
        ("emit_instances", Stage::Tile),
        ("tile_", Stage::Tile),
        ("layer_list", Stage::Tile),
        ("prepare_blend", Stage::Tile),
        ("blend_forward", Stage::BlendForward),
        ("ssim_", Stage::Loss),
        ("loss_", Stage::Loss),
        ("blend_backward", Stage::BlendBackward),
        ("gather", Stage::Gather),
        ("project_backward", Stage::ProjectBackward),
        ("adam", Stage::Optimise),
        ("lift_resolve", Stage::Labels),
    ];
    BY_PREFIX.iter().find(|(prefix, _)| stem.starts_with(prefix)).map_or(now, |(_, stage)| *stage)
}

#[cfg(test)]
mod tests {
    use super::{Stage, stages};
    use crate::pass::{KernelShape, Variant, training_step};
    use crate::scheduler::plan::Capacity;

    #[test]
    fn every_item_of_a_step_has_its_stage() {
        let (shape, capacity) = (KernelShape::new(8, true), Capacity { virtual_tiles: 100, ..Capacity::default() });
        let variant = Variant { labels: true, lift: true, sh_degree: 3, size: (64, 48), update: true, counts: false };
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
        // Apart from the two sorts and the two projections a step never goes back.
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
