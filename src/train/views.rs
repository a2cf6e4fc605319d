//! The training views, at full and at half size.

use super::step_input::{StepInput, TrainView};
use std::ops::{Deref, DerefMut};

/// The training views. As a slice, those at full size.
#[derive(Debug)]
pub(super) struct Views {
    whole: Vec<TrainView>,
    /// The views at half size, if some steps use them.
    halved: Vec<TrainView>,
    coarse_until: u32,
}

impl Views {
    /// Makes the views; steps up to `coarse_until` use half size.
    pub(super) fn new(whole: Vec<TrainView>, coarse_until: u32) -> Self {
        let halved = if coarse_until > 0 { whole.iter().map(TrainView::halved).collect() } else { Vec::new() };
        Self { whole, halved, coarse_until }
    }

    /// Returns the view of a step at the size of the step.
    pub(super) fn of(&self, input: &StepInput) -> &TrainView {
        if input.step <= self.coarse_until { &self.halved[input.view] } else { &self.whole[input.view] }
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
