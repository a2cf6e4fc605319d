//! Whether a step runs a list with a pass for each object, which is possible with the feature `lab` only.

use super::step_input::StepInput;
use crate::engine::ListKey;
use crate::pass::Variant;

/// Whether objects have passes of their own.
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
        (self.on && input.labels).then_some(ListKey::Separate(variant, input.layers.len() as u32))
    }
}

#[cfg(feature = "lab")]
impl super::Trainer {
    /// From the next step on each sampled object has passes of its own, as in the reference code: slower, and up to
    /// rounding the same. For measurements; nothing may be in flight ([`Trainer::drain`](super::Trainer::drain)).
    pub fn separate_objects(&mut self, separate: bool) {
        self.separate.on = separate;
    }
}
