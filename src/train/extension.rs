//! The passes that a training adds to its steps, from the strategy, shared parameters and objective.

use crate::pass::{Builder, Extension, Hook};
use std::sync::Arc;

/// The strategy's passes, with variant numbers shifted by one, and the passes of every step.
#[derive(Debug)]
pub(super) struct JoinedExtension {
    pub(super) strategy: Arc<dyn Extension>,
    pub(super) always: Vec<Arc<dyn Extension>>,
}

impl JoinedExtension {
    pub(super) fn join(strategy: Arc<dyn Extension>, always: Vec<Arc<dyn Extension>>) -> Arc<dyn Extension> {
        if always.is_empty() { strategy } else { Arc::new(Self { strategy, always }) }
    }
}

impl Extension for JoinedExtension {
    fn extend(&self, passes: u32, hook: Hook, b: &mut Builder) {
        if passes > 1 {
            self.strategy.extend(passes - 1, hook, b);
        }
        self.always.iter().for_each(|of| of.extend(1, hook, b));
    }

    fn updates_unseen(&self, passes: u32) -> bool {
        passes <= 1 || self.strategy.updates_unseen(passes - 1)
    }

    fn splits_update(&self, passes: u32) -> bool {
        (passes > 1 && self.strategy.splits_update(passes - 1)) || self.always.iter().any(|of| of.splits_update(1))
    }
}
