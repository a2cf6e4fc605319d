//! The Gaussians between two steps, for strategies to change, with a limit on their number.

use crate::engine::{Engine, ListKey};
use crate::error::{Error, Result, Setting};
use crate::shaders::constants::STAT_NEAR;
use crate::shaders::structs::{Counters, StepUniforms};
use crate::train::input::views::Views;

/// Counts of a densification.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DensifyCounts {
    /// Gaussians cloned.
    pub cloned: u32,
    /// Gaussians split.
    pub split: u32,
    /// Gaussians removed.
    pub pruned: u32,
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct GaussianLimit {
    /// Limit set by the user or the device.
    pub most: u64,
    /// True if memory has limited the number, which was logged.
    pub by_memory: bool,
}

/// The Gaussians on the device; nothing is in flight.
pub struct Population<'a> {
    pub(in crate::train) engine: &'a mut Engine,
    pub(in crate::train) bound: &'a mut GaussianLimit,
    pub(in crate::train) views: &'a Views,
    pub(in crate::train) uniforms: StepUniforms,
    pub(in crate::train) step: u32,
    pub(in crate::train) first_count: u32,
    /// Counts of the densification since the step.
    pub(in crate::train) densified: Option<DensifyCounts>,
}

impl Population<'_> {
    /// Returns the number of Gaussians.
    pub fn count(&self) -> u32 {
        self.engine.gaussian_count()
    }

    /// Returns the number of Gaussians before the strategy's first change, from which a budget rises.
    pub fn first_count(&self) -> u64 {
        self.first_count.into()
    }

    /// Returns the number of trained Gaussians, which come first.
    pub(crate) fn trained_count(&self) -> usize {
        self.engine.trained_count() as usize
    }

    /// Returns the uniforms of the step, with a separate seed.
    pub fn uniforms(&self) -> StepUniforms {
        self.uniforms
    }

    /// Returns the engine.
    pub fn engine(&mut self) -> &mut Engine {
        self.engine
    }

    /// Clones, splits and prunes by the thresholds in `uniforms`, up to `budget` Gaussians and within the limit.
    /// Resets statistics.
    pub fn densify(&mut self, uniforms: StepUniforms, budget: u64) -> Result<DensifyCounts> {
        let wanted = self.count_densified(uniforms)?.densified_count;
        let mut most = self.count_limit(wanted)?.min(budget);
        let (uniforms, counted) = loop {
            let bounded = self.bounded(uniforms, wanted, most)?;
            let counted = self.count_densified(bounded)?;
            match self.make_room(counted.densified_count.into(), most)? {
                Some(room) => most = room,
                None => break (bounded, counted),
            }
        };
        self.engine.run(ListKey::DensifyApply, &uniforms)?;
        self.engine.set_gaussian_count(counted.densified_count);
        if counted.densified_count == 0 {
            return Err(Error::Pruned { step: self.step });
        }
        let done =
            DensifyCounts { cloned: counted.cloned_count, split: counted.split_count, pruned: counted.pruned_count };
        self.densified = Some(done);
        Ok(done)
    }

    /// Removes some of the trained Gaussians and splits some others. Resets statistics.
    pub fn replace(&mut self, remove: &[usize], split: &[usize]) -> Result<DensifyCounts> {
        let mut marks = vec![[0.0; 2]; self.trained_count()];
        remove.iter().for_each(|&row| marks[row][1] = STAT_NEAR);
        split.iter().for_each(|&row| marks[row] = [1.0; 2]);
        self.engine.set_densify_stats(&marks)?;
        let uniforms = StepUniforms {
            densify_threshold: if split.is_empty() { 0.0 } else { 1.0 },
            // All that grow split.
            densify_scale: 0.0,
            split_long: 1,
            prune_opacity: 0.0,
            prune_big: 0,
            ..self.uniforms
        };
        self.densify(uniforms, u64::MAX)
    }

    /// Removes faint and marked Gaussians, and draws others in proportion to their opacity until there are `wanted`,
    /// within the limit. Each drawn Gaussian becomes a stack of copies that looks the same. Resets statistics.
    pub fn relocate(&mut self, uniforms: StepUniforms, wanted: u64) -> Result<DensifyCounts> {
        let counted = self.engine.run(ListKey::RelocateCount, &uniforms)?.counters;
        let (alive, weight) = (u64::from(self.count() - counted.pruned_count), counted.densified_count);
        if alive == 0 {
            return Err(Error::Pruned { step: self.step });
        }
        let mut most = self.count_limit(u32::try_from(wanted).unwrap_or(u32::MAX))?.max(alive);
        while let Some(room) = self.make_room(most, most)? {
            most = room;
        }
        let draws = (most - alive) as u32;
        let uniforms = StepUniforms { draws, draws_per_weight: draws as f32 / weight as f32, ..uniforms };
        let applied = self.engine.run(ListKey::RelocateApply, &uniforms)?.counters;
        self.engine.set_gaussian_count(applied.densified_count);
        let done = DensifyCounts { cloned: applied.cloned_count, split: 0, pruned: applied.pruned_count };
        self.densified = Some(done);
        Ok(done)
    }

    /// Makes room for a number of Gaussians. If memory is short, the current room becomes the limit and is returned,
    /// unless `most` is not larger.
    fn make_room(&mut self, count: u64, most: u64) -> Result<Option<u64>> {
        let room = self.engine.size().gaussians;
        match self.engine.make_room_for_gaussians(count) {
            Err(error) if error.is_out_of_memory() && most > room => {
                let hint = self.hint();
                tracing::warn!("{error}; the number of Gaussians stays at {room} until the run is resumed{hint}");
                *self.bound = GaussianLimit { most: room, by_memory: true };
                Ok(Some(room))
            }
            made => made.map(|()| None),
        }
    }

    /// Returns advice on how to fit more Gaussians, if any.
    fn hint(&self) -> String {
        let half = Setting("moments").to("half");
        if self.engine.size().half_moments { String::new() } else { format!("; a run with {half} has room for more") }
    }

    /// Lowers all opacities to at most 0.01.
    pub fn reset_opacity(&mut self) -> Result<()> {
        self.engine.run(ListKey::OpacityReset, &self.uniforms).map(drop)
    }

    fn count_densified(&mut self, uniforms: StepUniforms) -> Result<Counters> {
        Ok(self.engine.run(ListKey::DensifyCount, &uniforms)?.counters)
    }

    /// Returns the limit for `count` wanted Gaussians: the setting, or the number that fits into memory.
    fn count_limit(&mut self, count: u32) -> Result<u64> {
        let wanted = u64::from(count).min(self.bound.most);
        let fits = self.engine.most_gaussians(wanted)?;
        if fits < wanted && !self.bound.by_memory {
            self.bound.by_memory = true;
            let hint = self.hint();
            tracing::warn!(
                "memory is sufficient for {fits} of {wanted} wanted Gaussians; from here, only the best may grow{hint}"
            );
        }
        Ok(fits.min(self.bound.most))
    }

    /// Raises the gradient threshold until the result is within the limit, so that only Gaussians with the largest
    /// gradients grow.
    fn bounded(&mut self, uniforms: StepUniforms, count: u32, most: u64) -> Result<StepUniforms> {
        // Without growth there is nothing to limit.
        if u64::from(count) <= most || uniforms.densify_threshold <= 0.0 {
            return Ok(uniforms);
        }
        let (mut low, mut high) = (uniforms.densify_threshold, uniforms.densify_threshold * 2.0);
        let with = |threshold| StepUniforms { densify_threshold: threshold, ..uniforms };
        // Gradients in the statistic are finite, so a high enough threshold stops all growth.
        while high < f32::MAX && u64::from(self.count_densified(with(high))?.densified_count) > most {
            (low, high) = (high, (high * 2.0).min(f32::MAX));
        }
        for _ in 0..12 {
            let middle = 0.5 * (low + high);
            let fits = u64::from(self.count_densified(with(middle))?.densified_count) <= most;
            (low, high) = if fits { (low, middle) } else { (middle, high) };
        }
        Ok(with(high))
    }
}
