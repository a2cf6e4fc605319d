//! The passes that strategies add to training steps. The number of a variant has a bit for each.

use super::At;
use crate::pass::{Builder, Extension, Hook, densify, optimize};
use crate::shaders::structs::StepUniforms;

/// Marks Gaussians that fog the camera of the step.
pub const FREE_SPACE: u32 = 1;
/// Adds the gradients of mean opacity and size.
pub(crate) const REGULARISE: u32 = 2;
/// Moves faint Gaussians at random.
pub(crate) const EXPLORE: u32 = 4;
/// Keeps Gaussians from becoming finer than the photos can show.
pub(crate) const SMOOTH: u32 = 8;

/// The passes by their bits.
#[derive(Debug)]
pub(super) struct Passes;

impl Extension for Passes {
    fn extend(&self, passes: u32, hook: Hook, b: &mut Builder) {
        let has = |bit: u32| passes & bit != 0;
        if hook == Hook::Gradients && has(REGULARISE) {
            optimize::regularise(b);
        }
        if hook == Hook::Updated && has(EXPLORE) {
            optimize::explore(b);
        }
        if hook == Hook::Updated && has(SMOOTH) {
            optimize::smooth(b);
        }
        if hook == Hook::Updated && has(FREE_SPACE) {
            densify::mark_near(b);
        }
    }

    fn splits_update(&self, passes: u32) -> bool {
        passes & !FREE_SPACE != 0
    }
}

/// Returns the bits of the passes that the configuration asks for.
pub(super) fn of(at: At) -> u32 {
    let config = at.config;
    let regularises = config.opacity_weight() > 0.0 || config.scale_weight() > 0.0;
    (u32::from(config.free_space) * FREE_SPACE) | (u32::from(regularises) * REGULARISE) | smooth(at)
}

/// Returns the bit of [`SMOOTH`] if the configuration asks for it.
pub(super) fn smooth(at: At) -> u32 {
    u32::from(at.config.antialias) * SMOOTH
}

/// Sets the weights of [`REGULARISE`]. The means are over all Gaussians.
pub(super) fn regularise(at: At, to: &mut StepUniforms) {
    let count = f64::from(to.gaussian_count.max(1));
    to.opacity_weight = (at.config.opacity_weight() / count) as f32;
    to.scale_weight = (at.config.scale_weight() / (3.0 * count * at.extent)) as f32;
}
