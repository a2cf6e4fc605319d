//! No change of any Gaussian: only parameters of the scene and of photos are trained.

use super::{At, Strategy};
use crate::shaders::structs::StepUniforms;

/// The strategy.
#[derive(Debug)]
pub(crate) struct Frozen;

impl Strategy for Frozen {
    fn name(&self) -> &'static str {
        "frozen"
    }

    fn uniforms(&self, _at: At, to: &mut StepUniforms) {
        to.rate_means = [0.0; 4];
        (to.rate_scales, to.rate_quats, to.rate_sh0, to.rate_sh_rest) = (0.0, 0.0, 0.0, 0.0);
    }
}
