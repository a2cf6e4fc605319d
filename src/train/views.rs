//! The views of a training, at the sizes that steps look at them.

use super::step_input::{StepInput, TrainView};
use std::ops::{Deref, DerefMut};

/// The training views; as a slice, those at their full size.
#[derive(Debug)]
pub(super) struct Views {
    whole: Vec<TrainView>,
    /// The same at half the size, if some steps look at them.
    halved: Vec<TrainView>,
    coarse_until: u32,
}

impl Views {
    /// Views of which steps up to `coarse_until` look at halves.
    pub(super) fn new(whole: Vec<TrainView>, coarse_until: u32) -> Self {
        let halved = if coarse_until > 0 { whole.iter().map(TrainView::halved).collect() } else { Vec::new() };
        Self { whole, halved, coarse_until }
    }

    /// The view of a step, as the step looks at it.
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
