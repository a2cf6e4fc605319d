//! The strategy of 3DGS, adaptive density control: clones and splits Gaussians with large screen-space gradients,
//! prunes faint or too large ones, and resets opacities if the settings ask for it.

use super::{OPACITY_MIN, Population, StepContext, Strategy, passes};
use crate::error::Result;
use crate::scheduler::plan::Buf;
use crate::shaders::structs::StepUniforms;
use crate::train::TrainConfig;

/// Largest standard deviation of Gaussians that are cloned instead of split, scene extents (3DGS).
pub(crate) const CLONED_MAX: f32 = 0.01;
/// Largest standard deviation, scene extents; larger Gaussians are pruned after the first opacity reset (3DGS).
pub(crate) const SCALE_MAX: f32 = 0.1;

/// The strategy of 3DGS. It has no state: all decisions depend only on step and configuration.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct AdcStrategy;

impl Strategy for AdcStrategy {
    fn name(&self) -> &'static str {
        "adc"
    }

    fn acts_after(&self, at: StepContext) -> bool {
        !at.is_last() && (at.config.densifies_at(at.step) || resets_opacity_at(at.config, at.step))
    }

    fn act(&mut self, at: StepContext, population: &mut Population) -> Result<()> {
        let uniforms = uniforms(at, population.uniforms());
        if at.config.densifies_at(at.step) {
            let what = population.densify(uniforms, u64::MAX)?;
            tracing::debug!("step {}: {what:?}, {} Gaussians", at.step, population.count());
        }
        if resets_opacity_at(at.config, at.step) {
            population.reset_opacity()?;
        }
        Ok(())
    }

    /// Densification replaces the parameters that the gradients belong to, so no update follows (3DGS).
    fn updates(&self, at: StepContext) -> bool {
        at.is_last() || !at.config.densifies_at(at.step)
    }

    fn blurs_depth_after(&self, at: StepContext) -> bool {
        resets_opacity_at(at.config, at.step)
    }

    fn passes(&self, at: StepContext) -> u32 {
        passes::smooth(at)
    }

    fn planes(&self) -> &'static [Buf] {
        &[Buf::DENSIFY_STATS]
    }
}

fn uniforms(at: StepContext, step: StepUniforms) -> StepUniforms {
    let config = at.config;
    StepUniforms {
        densify_threshold: config.densify_grad_threshold,
        densify_scale: (f64::from(CLONED_MAX) * at.extent) as f32,
        prune_scale: (f64::from(SCALE_MAX) * at.extent) as f32,
        prune_opacity: OPACITY_MIN,
        prune_big: u32::from(prunes_large_at(config, at.step)),
        ..step
    }
}

/// Returns true if a densification at `step` also prunes by size.
pub(crate) fn prunes_large_at(config: &TrainConfig, step: u32) -> bool {
    config.opacity_reset_interval > 0 && step > config.opacity_reset_interval
}

/// Returns true for steps that end with an opacity reset.
pub fn resets_opacity_at(config: &TrainConfig, step: u32) -> bool {
    config.opacity_reset_interval > 0
        && step < config.densify_until()
        && step.is_multiple_of(config.opacity_reset_interval)
        && config.iterations.saturating_sub(step) > config.opacity_reset_margin
}
