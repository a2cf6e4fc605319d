//! The passes that strategies add to training steps. A variant number has one bit per pass. The
//! kernels of the update do most of their work.

use super::StepContext;
use crate::pass::{Builder, Extension, Hook, densify, optimize};
use crate::shaders::constants::{UPDATE_EXPLORES, UPDATE_REGULARISES, UPDATE_SMOOTHS};
use crate::shaders::structs::StepUniforms;

/// Marks Gaussians that fog the camera of the step.
pub const FREE_SPACE_BIT: u32 = 1;
/// Adds the gradients of mean opacity and size.
pub(crate) const REGULARISE_BIT: u32 = UPDATE_REGULARISES;
/// Moves faint Gaussians at random.
pub(crate) const EXPLORE_BIT: u32 = UPDATE_EXPLORES;
/// Keeps Gaussians from becoming finer than the photos can show.
pub(crate) const SMOOTH_BIT: u32 = UPDATE_SMOOTHS;

/// The passes, selected by their bits.
#[derive(Debug)]
pub(super) struct StrategyPasses;

impl Extension for StrategyPasses {
    fn extend(&self, passes: u32, hook: Hook, b: &mut Builder) {
        b.update_modes = passes & !FREE_SPACE_BIT;
        // An update in one kernel moves them, too.
        if hook == Hook::Updated && !b.late && passes & (EXPLORE_BIT | SMOOTH_BIT) != 0 {
            optimize::move_all(b);
        }
        let marks = passes & FREE_SPACE_BIT != 0;
        // The projection reads all Gaussians that may be late anyway.
        if hook == Hook::Camera && marks {
            b.marks_near = b.late;
        }
        if hook == Hook::Updated && marks && !b.late {
            densify::mark_near(b);
        }
    }

    fn splits_update(&self, _passes: u32) -> bool {
        false
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
