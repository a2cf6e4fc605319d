//! Stages of work that may take long, for whoever shows progress: each is a span of `tracing` of this target. It has `what` is
//! done, and how many of a `total` of items are `done`; a total of 0 is not known.

use std::fmt::Display;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use tracing::Span;

/// Target of the spans.
pub const TARGET: &str = "labelgs::stage";

/// A stage, from its making until it is dropped.
#[derive(Debug)]
pub struct Stage {
    span: Span,
    done: AtomicU64,
}

impl Stage {
    /// Begins a stage, such as `reading photos`.
    pub fn new(what: impl Display, total: usize) -> Self {
        let span = tracing::info_span!(target: TARGET, "stage", %what, total = total as u64, done = 0_u64);
        Self { span, done: AtomicU64::new(0) }
    }

    /// Makes an item and counts it.
    pub fn counted<T>(&self, make: impl FnOnce() -> T) -> T {
        let made = make();
        self.count();
        made
    }

    /// One more item is done, on any thread.
    pub fn count(&self) {
        self.span.record("done", self.done.fetch_add(1, Relaxed) + 1);
    }
}
