//! The parameters that a training optimises, and its losses.

use super::strategy::{self, Strategy};
use super::{LabelRule, StrategyKind, TrainConfig};
use crate::pass::{Builder, Extension, Hook};
use crate::scheduler::plan::Buf;
use crate::shaders::structs::StepUniforms;
use std::sync::Arc;

/// A property of the Gaussians that a training may change. [`SharedParameters`](super::shared::SharedParameters) have
/// learning rates of their own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Parameter {
    /// The number of Gaussians, by the [`Strategy`].
    Number,
    /// Positions.
    Positions,
    /// Scales.
    Scales,
    /// Rotations.
    Rotations,
    /// Opacities.
    Opacities,
    /// Spherical harmonics of all degrees.
    Colours,
    /// Labels, by votes or the paper's rule.
    Labels,
}

/// A loss. The configuration has its weight and schedule.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Loss {
    /// The picture of the scene against the photo.
    Photo,
    /// Renders of single objects against photo and mask.
    Layers,
    /// Labels in the scene's picture against the mask.
    Disagreement,
    /// Depths against known ones.
    Depth,
}

/// The parameters that a training optimises, and its losses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Objective {
    /// Properties of the Gaussians that change.
    pub parameters: &'static [Parameter],
    /// The losses.
    pub losses: &'static [Loss],
}

impl Default for Objective {
    fn default() -> Self {
        Self::SCENE
    }
}

impl Objective {
    /// A scene: all properties of its Gaussians, with all losses.
    pub const SCENE: Self = {
        use Parameter::{Colours, Labels, Number, Opacities, Positions, Rotations, Scales};
        Self {
            parameters: &[Number, Positions, Scales, Rotations, Opacities, Colours, Labels],
            losses: &[Loss::Photo, Loss::Layers, Loss::Disagreement, Loss::Depth],
        }
    };
    /// Opacities of objects, with renders of these objects alone.
    pub const OBJECT_OPACITIES: Self = Self { parameters: &[Parameter::Opacities], losses: &[Loss::Layers] };
    /// Shared parameters of a finished model, such as the poses of photos.
    pub const SHARED: Self = Self { parameters: &[], losses: &[Loss::Photo] };

    /// Returns true if the training changes this property.
    pub fn trains(&self, parameter: Parameter) -> bool {
        self.parameters.contains(&parameter)
    }

    /// Returns true if the training has a loss.
    pub fn has(&self, loss: Loss) -> bool {
        self.losses.contains(&loss)
    }

    /// Returns the configuration without unused parts: sets the weights of unused losses to 0, and disables the paper's
    /// label rule if labels do not change.
    pub(super) fn limit_config(&self, config: TrainConfig) -> TrainConfig {
        let depth_weight = if self.has(Loss::Depth) { config.depth_weight } else { Some(0.0) };
        let label_rule = if self.trains(Parameter::Labels) { config.label_rule } else { LabelRule::Votes };
        TrainConfig { depth_weight, label_rule, ..config }
    }

    /// Sets the learning rates of unchanged properties to 0.
    pub(super) fn limit_rates(&self, to: &mut StepUniforms) {
        let [x, y, z, opacity] = &mut to.rate_means;
        let (sh0, sh_rest) = (&mut to.rate_sh0, &mut to.rate_sh_rest);
        for (parameter, rates) in [
            (Parameter::Positions, vec![x, y, z]),
            (Parameter::Scales, vec![&mut to.rate_scales]),
            (Parameter::Rotations, vec![&mut to.rate_quats]),
            (Parameter::Opacities, vec![opacity]),
            (Parameter::Colours, vec![sh0, sh_rest]),
        ] {
            if !self.trains(parameter) {
                rates.into_iter().for_each(|rate| *rate = 0.0);
            }
        }
    }

    /// Returns the strategy for the number of Gaussians.
    pub(super) fn strategy(&self, kind: StrategyKind) -> Box<dyn Strategy> {
        if self.trains(Parameter::Number) { strategy::make(kind) } else { Box::new(()) }
    }

    /// Returns the passes that the objective adds to steps.
    pub(super) fn extension(&self) -> Option<Arc<dyn Extension>> {
        (!self.has(Loss::Photo)).then(|| Arc::new(WithoutPhotoLoss) as Arc<dyn Extension>)
    }
}

/// Measures the photo loss without a gradient.
#[derive(Debug)]
struct WithoutPhotoLoss;

impl Extension for WithoutPhotoLoss {
    fn extend(&self, _passes: u32, hook: Hook, b: &mut Builder) {
        if hook == Hook::Loss {
            b.list.fill(Buf::V_IMAGE, 0);
        }
    }

    fn splits_update(&self, _passes: u32) -> bool {
        false
    }
}

#[cfg(test)]
mod tests {
    use super::{Objective, Parameter};
    use crate::shaders::structs::StepUniforms;

    fn rates(objective: Objective) -> [f32; 8] {
        let mut of = StepUniforms {
            rate_means: [1.0; 4],
            rate_scales: 1.0,
            rate_quats: 1.0,
            rate_sh0: 1.0,
            rate_sh_rest: 1.0,
            ..StepUniforms::default()
        };
        objective.limit_rates(&mut of);
        let [x, y, z, opacity] = of.rate_means;
        [x, y, z, opacity, of.rate_scales, of.rate_quats, of.rate_sh0, of.rate_sh_rest]
    }

    #[test]
    fn only_what_is_trained_has_learning_rates() {
        assert_eq!(rates(Objective::SCENE), [1.0; 8]);
        assert_eq!(rates(Objective::SHARED), [0.0; 8]);
        assert_eq!(rates(Objective::OBJECT_OPACITIES), [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0]);
        let colours = Objective { parameters: &[Parameter::Colours], ..Objective::SCENE };
        assert_eq!(rates(colours), [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0]);
    }
}
