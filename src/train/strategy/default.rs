//! The strategy of 3DGS, adaptive density control: clones and splits Gaussians with large screen-space gradients,
//! prunes faint or too large ones, and resets opacities if the settings say so.

use super::{At, Population, Strategy};
use crate::error::Result;
use crate::scheduler::plan::Buf;
use crate::shaders::structs::StepUniforms;
use crate::train::TrainConfig;

/// The strategy of 3DGS. It has no state: all decisions follow from the step and the configuration.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct DefaultStrategy;

impl Strategy for DefaultStrategy {
    fn name(&self) -> &'static str {
        "default"
    }

    fn acts_after(&self, at: At) -> bool {
        !at.is_last() && (densifies_at(at.config, at.step) || resets_opacity_at(at.config, at.step))
    }

    fn act(&mut self, at: At, population: &mut Population) -> Result<()> {
        let uniforms = uniforms(at, population.uniforms());
        if densifies_at(at.config, at.step) {
            let what = population.densify(uniforms)?;
            tracing::debug!("step {}: {what:?}, {} Gaussians", at.step, population.count());
        }
        if resets_opacity_at(at.config, at.step) {
            population.reset_opacity()?;
        }
        Ok(())
    }

    /// A densification replaces the parameters of the gradients, so that no update follows (3DGS).
    fn updates(&self, at: At) -> bool {
        at.is_last() || !densifies_at(at.config, at.step)
    }

    fn blurs_depth_after(&self, at: At) -> bool {
        resets_opacity_at(at.config, at.step)
    }

    fn planes(&self) -> &'static [Buf] {
        &[Buf::DENSIFY_STATS]
    }
}

fn uniforms(at: At, step: StepUniforms) -> StepUniforms {
    let config = at.config;
    StepUniforms {
        densify_threshold: config.densify_grad_threshold,
        densify_scale: (f64::from(config.percent_dense) * at.extent) as f32,
        prune_scale: (f64::from(config.max_scale) * at.extent) as f32,
        prune_opacity: config.min_opacity,
        prune_big: u32::from(prunes_large_at(config, at.step)),
        ..step
    }
}

pub(crate) fn densify_until(config: &TrainConfig) -> u32 {
    /// Fewest steps of densification in a short run.
    const LEAST: u32 = 1000;
    config.densify_until.unwrap_or((config.iterations / 2).max(config.densify_from.saturating_add(LEAST)))
}

/// Returns true for steps that end with a densification.
pub fn densifies_at(config: &TrainConfig, step: u32) -> bool {
    step < densify_until(config) && step > config.densify_from && step.is_multiple_of(config.densify_interval)
}

/// Returns true if a densification at `step` also prunes by size.
pub(crate) fn prunes_large_at(config: &TrainConfig, step: u32) -> bool {
    config.opacity_reset_interval > 0 && step > config.opacity_reset_interval
}

/// Returns true for steps that end with an opacity reset.
pub fn resets_opacity_at(config: &TrainConfig, step: u32) -> bool {
    config.opacity_reset_interval > 0
        && step < densify_until(config)
        && step.is_multiple_of(config.opacity_reset_interval)
        && config.iterations.saturating_sub(step) > config.opacity_reset_margin
}
