//! The passes of each object in lists of their own, for measurements. Needs the feature `lab`.

use super::step_input::StepInput;
use crate::engine::ListKey;
use crate::pass::Variant;

#[derive(Default)]
pub(super) struct Separate {
    #[cfg(feature = "lab")]
    on: bool,
}

impl Separate {
    #[cfg(not(feature = "lab"))]
    pub(super) fn key(&self, _: Variant, _: &StepInput) -> Option<ListKey> {
        None
    }

    #[cfg(feature = "lab")]
    pub(super) fn key(&self, variant: Variant, input: &StepInput) -> Option<ListKey> {
        (self.on && !input.layers.is_empty()).then_some(ListKey::Separate(variant, input.layers.len() as u32))
    }
}

#[cfg(feature = "lab")]
impl super::Trainer {
    /// Gives each sampled object passes of its own from the next step on, as in the reference code. That is slower,
    /// with equal results up to rounding. Nothing may be in flight ([`Trainer::drain`](super::Trainer::drain)).
    pub fn separate_objects(&mut self, separate: bool) {
        self.separate.on = separate;
    }
}
