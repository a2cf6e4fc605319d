//! A fixed number of Gaussians that explore the scene (3DGS-MCMC, Kheradmand et al. 2024): faint ones move at random;
//! dead ones become copies of others, drawn by their opacity. The loss keeps opacities and sizes small.
//!
//! Three things differ from the paper. The number of Gaussians rises linearly to the budget, because growing by a
//! twentieth per event needs long runs. A stack of copies preserves the Gaussian's light in a picture, not along a
//! line. The learning-rate factor for short runs does not apply to the moves.

use super::{OPACITY_MIN, Population, StepContext, Strategy, passes};
use crate::error::Result;
use crate::scheduler::plan::Buf;
use crate::shaders::structs::StepUniforms;

/// Random movement per position learning rate, both in scene extents (3DGS-MCMC).
const NOISE_PER_RATE: f64 = 5e5;

/// Relocation.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct McmcStrategy;

impl Strategy for McmcStrategy {
    fn name(&self) -> &'static str {
        "mcmc"
    }

    fn acts_after(&self, at: StepContext) -> bool {
        !at.is_last() && (at.config.relocates_at(at.step) || at.config.prunes_at(at.step))
    }

    fn act(&mut self, at: StepContext, population: &mut Population) -> Result<()> {
        let config = at.config;
        let start = population.first_count();
        let wanted = if config.relocates_at(at.step) { config.budget_at(at.step, start) } else { 0 };
        let uniforms = StepUniforms { prune_opacity: OPACITY_MIN, ..population.uniforms() };
        let what = population.relocate(uniforms, wanted)?;
        tracing::debug!("step {}: {what:?}, {} Gaussians", at.step, population.count());
        Ok(())
    }

    fn uniforms(&self, at: StepContext, to: &mut StepUniforms) {
        passes::regularise(at, to);
        let rate = at.config.rates_at(at.step).position / at.config.rate_factor();
        to.noise = (NOISE_PER_RATE * rate / at.extent) as f32;
    }

    fn passes(&self, at: StepContext) -> u32 {
        passes::pass_bits(at) | passes::EXPLORE_BIT
    }

    fn planes(&self) -> &'static [Buf] {
        &[Buf::DENSIFY_STATS]
    }
}
