//! Densification and opacity reset between steps, with a bound on the number of Gaussians.

use super::Trainer;
use super::step_input::StepInput;
use crate::engine::ListKey;
use crate::error::Result;
use crate::shaders::structs::{Counters, StepUniforms};

/// What a densification did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Densified {
    /// Gaussians cloned.
    pub cloned: u32,
    /// Gaussians split.
    pub split: u32,
    /// Gaussians removed.
    pub pruned: u32,
}

impl Trainer {
    /// Clones, splits and prunes after `input`, whose statistics are in; all earlier submits are done.
    pub(super) fn densify(&mut self, input: &StepInput) -> Result<Densified> {
        let wished = self.densify_uniforms(input);
        let wanted = self.count_densified(wished)?.densified_count;
        let mut bound = self.bound(wanted)?;
        let (uniforms, counted) = loop {
            let uniforms = self.bounded(wished, wanted, bound)?;
            let counted = self.count_densified(uniforms)?;
            let room = self.engine.room().gaussians;
            match self.engine.make_room_for_gaussians(u64::from(counted.densified_count)) {
                Err(error) if error.is_out_of_memory() && bound > room => {
                    tracing::warn!("{error}; from here on there are no more than {room} Gaussians (until --resume)");
                    (self.max_gaussians, self.memory_bounds) = (room, true);
                    bound = room;
                }
                other => break other.map(|()| (uniforms, counted))?,
            }
        };
        self.engine.run(ListKey::DensifyApply, &uniforms)?;
        self.engine.set_gaussian_count(counted.densified_count);
        Ok(Densified { cloned: counted.cloned_count, split: counted.split_count, pruned: counted.pruned_count })
    }

    /// Brings all opacities down to at most 0.01.
    pub(super) fn reset_opacity(&mut self, input: &StepInput) -> Result<()> {
        let uniforms = self.densify_uniforms(input);
        self.engine.run(ListKey::OpacityReset, &uniforms)?;
        Ok(())
    }

    fn densify_uniforms(&self, input: &StepInput) -> StepUniforms {
        let config = &self.config;
        StepUniforms {
            densify_threshold: config.densify_grad_threshold,
            densify_scale: (f64::from(config.percent_dense) * self.fixed.extent) as f32,
            prune_scale: (f64::from(config.max_scale) * self.fixed.extent) as f32,
            prune_opacity: config.min_opacity,
            prune_big: u32::from(config.prunes_large_at(input.step)),
            seed: (config.seed as u32) ^ input.step.wrapping_mul(0x9e37_79b9),
            ..super::step_input::uniforms(input, self.views.of(input), config, self.fixed, &self.engine)
        }
    }

    fn count_densified(&mut self, uniforms: StepUniforms) -> Result<Counters> {
        Ok(self.engine.run(ListKey::DensifyCount, &uniforms)?.counters)
    }

    /// The most Gaussians that there may be, of `count` that are wanted: what was asked for, and what memory holds.
    fn bound(&mut self, count: u32) -> Result<u64> {
        let wanted = u64::from(count).min(self.max_gaussians);
        let fits = self.engine.most_gaussians(wanted)?;
        if fits < wanted && !self.memory_bounds {
            self.memory_bounds = true;
            tracing::warn!("memory holds {fits} Gaussians, {wanted} are wanted; from here on only the best may grow");
        }
        Ok(fits.min(self.max_gaussians))
    }

    /// Raises the gradient threshold until the result fits the bound: those that need it most grow first.
    fn bounded(&mut self, uniforms: StepUniforms, count: u32, bound: u64) -> Result<StepUniforms> {
        if u64::from(count) <= bound {
            return Ok(uniforms);
        }
        let (mut low, mut high) = (uniforms.densify_threshold, uniforms.densify_threshold * 2.0);
        let with = |threshold| StepUniforms { densify_threshold: threshold, ..uniforms };
        // The statistic has no infinite gradients, so some threshold lets nothing grow.
        while high < f32::MAX && u64::from(self.count_densified(with(high))?.densified_count) > bound {
            (low, high) = (high, (high * 2.0).min(f32::MAX));
        }
        for _ in 0..12 {
            let middle = 0.5 * (low + high);
            let fits = u64::from(self.count_densified(with(middle))?.densified_count) <= bound;
            (low, high) = if fits { (low, middle) } else { (middle, high) };
        }
        Ok(with(high))
    }
}
