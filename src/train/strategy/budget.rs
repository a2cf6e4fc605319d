//! Growth within a budget: the Gaussians with the largest gradients split along their longest axis (Improved-GS).
//!
//! The statistic sums absolute gradients of tiles, because gradients of a Gaussian's two sides cancel (AbsGS, by
//! pixel). The budget rises linearly during growth. Afterwards densifications only prune. Once, Gaussians that show
//! little are replaced by splitting Gaussians across mask contours. A separate pass marks Gaussians that fog the
//! cameras.

use super::exchange::exchange;
use super::{OPACITY_MIN, Population, StepContext, Strategy, passes};
use crate::error::Result;
use crate::scheduler::plan::Buf;
use crate::shaders::structs::StepUniforms;

/// Growth within a budget.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct BudgetStrategy;

impl Strategy for BudgetStrategy {
    fn name(&self) -> &'static str {
        "budget"
    }

    fn acts_after(&self, at: StepContext) -> bool {
        !at.is_last()
            && (at.config.densifies_at(at.step) || at.config.prunes_at(at.step) || at.config.exchanges_at(at.step))
    }

    fn act(&mut self, at: StepContext, population: &mut Population) -> Result<()> {
        let config = at.config;
        let grows = config.densifies_at(at.step);
        let uniforms = StepUniforms {
            densify_threshold: if grows { config.densify_grad_threshold } else { 0.0 },
            // All growing Gaussians split.
            densify_scale: 0.0,
            split_long: 1,
            prune_opacity: OPACITY_MIN,
            ..population.uniforms()
        };
        let mut what = population.densify(uniforms, config.budget_at(at.step, population.first_count()))?;
        if config.exchanges_at(at.step) {
            let changed = exchange(population, config)?;
            what.pruned += changed.pruned;
            what.split += changed.split;
        }
        tracing::debug!("step {}: {what:?}, {} Gaussians", at.step, population.count());
        Ok(())
    }

    fn uniforms(&self, at: StepContext, to: &mut StepUniforms) {
        passes::regularise(at, to);
        to.sum_absolute = 1;
    }

    fn passes(&self, at: StepContext) -> u32 {
        passes::pass_bits(at)
    }

    fn planes(&self) -> &'static [Buf] {
        &[Buf::DENSIFY_STATS]
    }
}
