//! What a step worked on: its cost depends on these.

use super::TrainConfig;
use super::step_input::{StepInput, StepView};

/// What a step does for labels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum LabelWork {
    /// Nothing: before labels start, between two steps with labels, or without masks.
    #[default]
    None,
    /// The disagreement of labels in the walk of the scene.
    Disagreement,
    /// Layers of sampled objects.
    Layers,
}

/// What a step worked on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StepKind {
    /// Width and height of its photo, px.
    pub size: (u32, u32),
    /// Degree of the spherical harmonics.
    pub sh_degree: u32,
    /// Work for labels.
    pub labels: LabelWork,
}

impl StepKind {
    pub(super) fn new(input: &StepInput, view: &StepView, config: &TrainConfig) -> Self {
        let labels = match (input.layers.is_empty(), input.labels) {
            (false, _) => LabelWork::Layers,
            (true, true) => LabelWork::Disagreement,
            (true, false) => LabelWork::None,
        };
        let size = (view.camera.width, view.camera.height);
        Self { size, sh_degree: config.sh_degree_at(input.step), labels }
    }
}
