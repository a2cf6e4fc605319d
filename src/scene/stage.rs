//! Stages of lengthy work, for progress displays. Each stage is a `tracing` span with this target. Its fields are
//! `what` is being done, and how many of the `total` items are `done`; a total of 0 means unknown.

use std::fmt::Display;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use tracing::Span;

/// Target of the spans.
pub const STAGE_TARGET: &str = "labelgs::stage";

/// A stage, from its creation until it is dropped.
#[derive(Debug)]
pub struct Stage {
    span: Span,
    done: AtomicU64,
}

impl Stage {
    /// Starts a stage, such as `reading photos`.
    pub fn new(what: impl Display, total: usize) -> Self {
        let span = tracing::info_span!(target: STAGE_TARGET, "stage", %what, total = total as u64, done = 0_u64);
        Self { span, done: AtomicU64::new(0) }
    }

    /// Runs `make` and counts its result as an item.
    pub fn counted<T>(&self, make: impl FnOnce() -> T) -> T {
        let made = make();
        self.count();
        made
    }

    /// Counts an item; may be called on any thread.
    pub fn count(&self) {
        self.span.record("done", self.done.fetch_add(1, Relaxed) + 1);
    }

    /// So many items are done by now; fewer than before change nothing.
    pub fn reach(&self, done: usize) {
        let done = done as u64;
        self.span.record("done", self.done.fetch_max(done, Relaxed).max(done));
    }
}
