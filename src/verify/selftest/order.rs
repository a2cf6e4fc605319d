//! The splats of a view in depth order, however they are numbered.

use super::fixture::Fixture;
use crate::error::{Error, Result};
use crate::scheduler::plan::Buf;

/// The splats of a view, by depth.
#[derive(Clone, Debug)]
pub struct DepthOrder {
    /// Number of each splat.
    pub splats: Vec<u32>,
    /// Its Gaussian.
    pub gaussians: Vec<u32>,
    /// Bits of its depth.
    pub keys: Vec<u32>,
}

impl DepthOrder {
    /// Reads the order after a step.
    pub fn read(fixture: &mut Fixture) -> Result<Self> {
        let visible = fixture.engine.report(0)?.counters.visible_count as usize;
        let own = fixture.get::<u32>(Buf::DEPTH_VALUES_A, visible)?;
        let splats = if fixture.engine.shape().group_walks {
            fixture.get::<u32>(Buf::DEPTH_ORDER, visible)?
        } else {
            (0..visible as u32).collect()
        };
        let gaussian = |&splat: &u32| own.get(splat as usize).copied();
        let gaussians: Option<Vec<u32>> = splats.iter().map(gaussian).collect();
        let gaussians =
            gaussians.ok_or_else(|| Error::Check(format!("the order of {visible} splats contains invalid indices")))?;
        // Look-back passes count from the near plane.
        let first = if fixture.engine.shape().group_walks { fixture.uniforms().near.to_bits() } else { 0 };
        let keys = fixture.get::<u32>(Buf::DEPTH_KEYS_A, visible)?.iter().map(|key| first + key).collect();
        Ok(Self { splats, gaussians, keys })
    }

    /// Reorders per-splat values by depth.
    pub fn sorted<T: Copy>(&self, of: &[T]) -> Vec<T> {
        self.splats.iter().map(|&splat| of[splat as usize]).collect()
    }

    /// Depth rank of each splat.
    pub fn ranks(&self) -> Vec<u32> {
        let mut ranks = vec![0; self.splats.len()];
        (0..).zip(&self.splats).for_each(|(rank, &splat)| ranks[splat as usize] = rank);
        ranks
    }
}
