//! The training views, at the size of each step.

use super::TrainConfig;
use super::step_input::{StepInput, TrainView, side_at};
use crate::scheduler::plan::FRAMES_IN_FLIGHT;
use std::collections::BTreeMap;
use std::ops::{Deref, DerefMut};

/// Number of sizes below the full one.
const SIZES: u32 = 8;

/// The training views. As a slice, those at full size.
#[derive(Debug)]
pub(super) struct Views {
    whole: Vec<TrainView>,
    /// Shrunk views that steps in flight use, by size and view.
    shrunk: BTreeMap<(u32, usize), TrainView>,
    start: f64,
    full_from: u32,
}

impl Views {
    /// Makes the views of a training.
    pub(super) fn new(whole: Vec<TrainView>, config: &TrainConfig) -> Self {
        let (start, full_from) = (f64::from(config.start_size), config.full_size_from());
        Self { whole, shrunk: BTreeMap::new(), start, full_from }
    }

    /// Returns the number of the size of `step`, from 0; [`SIZES`] is the full one.
    fn size_at(&self, step: u32) -> u32 {
        if step < self.full_from {
            (u64::from(step) * u64::from(SIZES) / u64::from(self.full_from)) as u32
        } else {
            SIZES
        }
    }

    /// Returns the share of the full size of `step`. Sizes grow in equal ratios.
    pub(super) fn share_at(&self, step: u32) -> f64 {
        self.start.powf(1.0 - f64::from(self.size_at(step)) / f64::from(SIZES))
    }

    /// Returns an upper bound of the image size at `step`, given that of full size.
    pub(super) fn largest_at(&self, step: u32, full: (u32, u32)) -> (u32, u32) {
        let share = self.share_at(step);
        (side_at(full.0, share), side_at(full.1, share))
    }

    /// Makes the view of a step at the size of the step.
    pub(super) fn prepare(&mut self, step: u32, view: usize) {
        let size = self.size_at(step);
        // Steps in flight still use their sizes.
        let oldest = self.size_at(step.saturating_sub(FRAMES_IN_FLIGHT as u32));
        self.shrunk.retain(|&(kept, _), _| kept >= oldest);
        if size < SIZES && !self.shrunk.contains_key(&(size, view)) {
            let shrunk = self.whole[view].shrunk(self.share_at(step));
            self.shrunk.insert((size, view), shrunk);
        }
    }

    /// Returns the view of a step at the size of the step, which [`Self::prepare`] has made.
    pub(super) fn of(&self, input: &StepInput) -> &TrainView {
        self.shrunk.get(&(self.size_at(input.step), input.view)).unwrap_or(&self.whole[input.view])
    }
}

impl Deref for Views {
    type Target = [TrainView];

    fn deref(&self) -> &[TrainView] {
        &self.whole
    }
}

impl DerefMut for Views {
    fn deref_mut(&mut self) -> &mut [TrainView] {
        &mut self.whole
    }
}
