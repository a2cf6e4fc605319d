//! The passes that strategies add to training steps. A variant number has one bit per pass.

use super::StepContext;
use crate::pass::{Builder, Extension, Hook, densify, optimize};
use crate::shaders::structs::StepUniforms;

/// Marks Gaussians that fog the camera of the step.
pub const FREE_SPACE_BIT: u32 = 1;
/// Adds the gradients of mean opacity and size.
pub(crate) const REGULARISE_BIT: u32 = 2;
/// Moves faint Gaussians at random.
pub(crate) const EXPLORE_BIT: u32 = 4;
/// Keeps Gaussians from becoming finer than the photos can show.
pub(crate) const SMOOTH_BIT: u32 = 8;

/// The passes, selected by their bits.
#[derive(Debug)]
pub(super) struct StrategyPasses;

impl Extension for StrategyPasses {
    fn extend(&self, passes: u32, hook: Hook, b: &mut Builder) {
        let has = |bit: u32| passes & bit != 0;
        if hook == Hook::Gradients && has(REGULARISE_BIT) {
            optimize::regularise(b);
        }
        if hook == Hook::Updated && has(EXPLORE_BIT) {
            optimize::explore(b);
        }
        if hook == Hook::Updated && has(SMOOTH_BIT) {
            optimize::smooth(b);
        }
        // The projection reads all Gaussians that may be late anyway.
        if hook == Hook::Camera && has(FREE_SPACE_BIT) {
            b.marks_near = b.late;
        }
        if hook == Hook::Updated && has(FREE_SPACE_BIT) && !b.late {
            densify::mark_near(b);
        }
    }

    fn splits_update(&self, passes: u32) -> bool {
        passes & !FREE_SPACE_BIT != 0
    }
}

/// Returns the bits of the passes that the configuration needs.
pub(super) fn pass_bits(at: StepContext) -> u32 {
    let config = at.config;
    let regularises = config.opacity_weight() > 0.0 || config.scale_weight() > 0.0;
    (u32::from(config.free_space) * FREE_SPACE_BIT) | (u32::from(regularises) * REGULARISE_BIT) | smooth(at)
}

/// Returns the bit of [`SMOOTH_BIT`] if the configuration needs it.
pub(super) fn smooth(at: StepContext) -> u32 {
    u32::from(at.config.antialias) * SMOOTH_BIT
}

/// Sets the weights of [`REGULARISE_BIT`]. The means are over all Gaussians.
pub(super) fn regularise(at: StepContext, to: &mut StepUniforms) {
    let count = f64::from(to.gaussian_count.max(1));
    to.opacity_weight = (at.config.opacity_weight() / count) as f32;
    to.scale_weight = (at.config.scale_weight() / (3.0 * count * at.extent)) as f32;
}
