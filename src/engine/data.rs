//! Typed access to device buffers. No list may be in flight.

use super::{Engine, late, model};
use crate::error::Result;
use crate::pass::SHARED_PLANES;
use crate::scheduler::Scheduler;
#[cfg(feature = "cli")]
use crate::scheduler::Traffic;
use crate::scheduler::plan::Buf;
use crate::shaders::constants::LABEL_MASK;

impl Engine {
    /// Positions of the Gaussians, relative to [`Engine::origin`].
    pub(crate) fn means(&mut self) -> Result<Vec<[f32; 3]>> {
        let (late, floats) = (self.late()?, 4 * self.gaussian_count as usize);
        let rows = late::read(&mut self.sched, late.as_ref(), Buf::MEANS, floats)?;
        Ok(rows.as_chunks::<4>().0.iter().map(|&[x, y, z, _]| [x, y, z]).collect())
    }

    /// Bytes in use on the device.
    pub fn memory(&self) -> u64 {
        self.sched.memory_total()
    }

    /// Bytes transferred between host and device so far.
    #[cfg(feature = "cli")]
    pub(crate) fn traffic(&self) -> Traffic {
        self.sched.traffic()
    }

    /// Labels of the Gaussians; only for an engine with labels.
    pub fn labels(&mut self) -> Result<Vec<u32>> {
        let mut labels = self.sched.download(Buf::LABELS, 0, 0, self.gaussian_count as usize)?;
        self.ids.unpack(&mut labels);
        Ok(labels)
    }

    /// Replaces the labels.
    pub fn set_labels(&mut self, labels: &[u32]) -> Result<()> {
        self.ids = model::upload_labels(&mut self.sched, labels, &self.size)?;
        Ok(())
    }

    /// The shared parameters; empty if the engine has none.
    #[doc(hidden)]
    pub fn shared(&mut self) -> Result<Vec<[f32; 4]>> {
        self.sched.download(Buf::SHARED, 0, 0, self.size.shared_rows as usize)
    }

    /// Replaces the first shared parameters; the moments of all of them become 0.
    pub(crate) fn set_shared(&mut self, rows: &[[f32; 4]]) -> Result<()> {
        for plane in &SHARED_PLANES[1..] {
            self.sched.fill(*plane, 0)?;
        }
        self.sched.upload(Buf::SHARED, 0, 0, rows)
    }

    /// Sets the densification statistic: a sum and a number of views for each trained Gaussian.
    pub(crate) fn set_densify_stats(&mut self, stats: &[[f32; 2]]) -> Result<()> {
        self.sched.upload(Buf::DENSIFY_STATS, 0, 0, stats)
    }

    /// The densification statistic of the trained Gaussians.
    pub(crate) fn densify_stats(&mut self) -> Result<Vec<[f32; 2]>> {
        self.sched.download(Buf::DENSIFY_STATS, 0, 0, self.trained_count() as usize)
    }

    /// Sets all votes to 0.
    pub(crate) fn clear_votes(&mut self) -> Result<()> {
        self.sched.fill(Buf::VOTES_LOW, 0)?;
        self.sched.fill(Buf::VOTES_HIGH, 0)
    }

    /// Votes for each Gaussian and column, `[N, columns]`.
    pub(crate) fn votes(&mut self, columns: usize) -> Result<Vec<u64>> {
        let cells = self.gaussian_count as usize * columns;
        let low = self.sched.download::<u32>(Buf::VOTES_LOW, 0, 0, cells)?;
        let high = self.sched.download::<u32>(Buf::VOTES_HIGH, 0, 0, cells)?;
        Ok(low.into_iter().zip(high).map(|(low, high)| u64::from(high) << 32 | u64::from(low)).collect())
    }

    /// Picture of the last list: r, g, b over the background, and the final transmittance.
    pub(crate) fn picture(&mut self, pixels: usize) -> Result<Vec<[f32; 4]>> {
        self.sched.download(Buf::IMAGE, 0, 0, pixels)
    }

    /// Main Gaussian of each pixel of the last render, -1 if no Gaussian contributes.
    pub(crate) fn main_gaussians(&mut self, pixels: usize) -> Result<Vec<i32>> {
        self.sched.download(Buf::MAIN_GAUSSIAN, 0, 0, pixels)
    }

    /// Weight of each pixel's main Gaussian, and the weighted sum of z over all Gaussians.
    pub(crate) fn weights_and_depths(&mut self, pixels: usize) -> Result<Vec<[f32; 2]>> {
        self.sched.download(Buf::MAIN_WEIGHT_DEPTH, 0, 0, pixels)
    }

    /// Label of each pixel of the last list with a label map.
    pub(crate) fn label_map(&mut self, pixels: usize) -> Result<Vec<u32>> {
        let mut labels = self.sched.download::<u32>(Buf::LABEL_MAP, 0, 0, pixels)?;
        labels.iter_mut().for_each(|word| *word &= LABEL_MASK);
        self.ids.unpack(&mut labels);
        Ok(labels)
    }

    /// Sets a coordinate of the first position to NaN, to simulate a faulty device.
    pub(crate) fn spoil(&mut self) -> Result<()> {
        self.sched.upload(Buf::MEANS, 0, 0, &[f32::NAN])
    }

    /// The scheduler, for tests, the self-test and benchmarks that read buffers directly.
    #[doc(hidden)]
    pub fn raw(&self) -> &Scheduler {
        &self.sched
    }

    /// Same as [`Engine::raw`], for uploads, downloads and custom lists.
    #[doc(hidden)]
    pub fn raw_mut(&mut self) -> &mut Scheduler {
        &mut self.sched
    }
}
