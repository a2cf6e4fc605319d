//! Changes the set of Gaussians after a step, by the strategy.

use super::StepJob;
use crate::error::{Error, Result};
use crate::phases::{self, Phase};
use crate::train::TrainConfig;
use crate::train::context::Context;
use crate::train::strategy::{DensifyCounts, GaussianLimit, Population, StepContext};

/// Clones, splits and prunes Gaussians.
#[derive(Clone, Copy, Debug)]
pub(in crate::train) struct Growth {
    /// Limit on the number of Gaussians.
    pub(in crate::train) bound: GaussianLimit,
    /// Counts of the latest densification; cleared when the caller takes them.
    pub(in crate::train) densified: Option<DensifyCounts>,
    /// Number of Gaussians before the strategy's first change.
    pub(in crate::train) first_count: Option<u32>,
}

impl Growth {
    pub(in crate::train) fn new(config: &TrainConfig) -> Self {
        let most = if config.max_gaussians > 0 { config.max_gaussians } else { u64::from(u32::MAX) };
        Self { bound: GaussianLimit { most, by_memory: false }, densified: None, first_count: None }
    }
}

impl StepJob<Context> for Growth {
    fn is_due(&self, step: u32, context: &Context) -> bool {
        context.strategy.acts_after(context.step_context(step))
    }

    fn run(&mut self, step: u32, context: &mut Context) -> Result<()> {
        context.refresh_poses()?;
        let missing = || Error::Bug("the strategy acts before the first step".to_owned());
        let uniforms = context.uniforms(context.newest.as_ref().ok_or_else(missing)?)?;
        let extent = context.step_context(step).extent;
        let Context { engine, config, strategy, views, .. } = context;
        let first_count = *self.first_count.get_or_insert(engine.gaussian_count());
        let bound = &mut self.bound;
        let mut population = Population { engine, bound, views, uniforms, step, first_count, densified: None };
        phases::timed(Phase::Densify, || strategy.act(StepContext { step, config, extent }, &mut population))?;
        self.densified = population.densified.or(self.densified);
        Ok(())
    }
}
