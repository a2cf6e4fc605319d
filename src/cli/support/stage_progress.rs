//! Progress of stages that take longer than two seconds: a bar on a terminal, otherwise lines.

use crate::cli::support::log::{PLAIN_AFTER, PLAIN_EVERY, bar};
use crate::stage::STAGE_TARGET;
use indicatif::ProgressBar;
use std::collections::BTreeMap;
use std::fmt::Debug;
use std::io::IsTerminal;
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};
use tracing::field::{Field, Visit};
use tracing::span::{Attributes, Id, Record};
use tracing_subscriber::Layer;
use tracing_subscriber::layer::Context;

/// Time between two looks at the stages.
const LOOK_EVERY: Duration = Duration::from_millis(200);

/// The stages of this moment, by the number of their span.
static RUNNING_STAGES: Mutex<BTreeMap<u64, RunningStage>> = Mutex::new(BTreeMap::new());

/// A stage that has not ended.
struct RunningStage {
    what: String,
    total: u64,
    done: u64,
    start: Instant,
    /// Time of the last progress line.
    told: Option<Instant>,
    bar: Option<ProgressBar>,
}

impl Visit for RunningStage {
    fn record_u64(&mut self, field: &Field, value: u64) {
        match field.name() {
            "total" => self.total = value,
            // Threads may count in another order than they record.
            _ => self.done = self.done.max(value),
        }
    }

    fn record_debug(&mut self, field: &Field, value: &dyn Debug) {
        if field.name() == "what" {
            self.what = format!("{value:?}");
        }
    }
}

impl RunningStage {
    /// Shows the stage if it is time for it; returns a line to print.
    fn shown(&mut self, is_terminal: bool) -> Option<String> {
        if self.start.elapsed() < PLAIN_AFTER || self.what.is_empty() {
            return None;
        }
        if is_terminal {
            let (total, text) = (self.total, self.text(self.start.elapsed()));
            let bar = self.bar.get_or_insert_with(|| bar(total));
            bar.set_position(self.done);
            bar.set_message(text);
            bar.tick();
            return None;
        }
        if self.told.is_some_and(|told| told.elapsed() < PLAIN_EVERY) {
            return None;
        }
        let is_first = self.told.replace(Instant::now()).is_none();
        Some(self.text(if is_first { Duration::ZERO } else { self.start.elapsed() }))
    }

    /// Progress of the stage, or its running time if its length is unknown.
    fn text(&self, spent: Duration) -> String {
        match (self.total, spent.as_secs()) {
            (0, 0) => self.what.clone(),
            (0, seconds) => format!("{}: {seconds} s so far", self.what),
            (total, _) => format!("{}: {} of {total}", self.what, self.done),
        }
    }
}

/// Keeps the stages of the library.
pub(crate) struct Stages;

impl Stages {
    fn update(id: &Id, change: impl FnOnce(&mut BTreeMap<u64, RunningStage>, u64)) {
        change(&mut RUNNING_STAGES.lock().unwrap_or_else(PoisonError::into_inner), id.into_u64());
    }
}

impl<S: tracing::Subscriber> Layer<S> for Stages {
    fn on_new_span(&self, attributes: &Attributes<'_>, id: &Id, _: Context<'_, S>) {
        if attributes.metadata().target() == STAGE_TARGET {
            let (what, start) = (String::new(), Instant::now());
            let mut stage = RunningStage { what, total: 0, done: 0, start, told: None, bar: None };
            attributes.record(&mut stage);
            Self::update(id, |stages, id| drop(stages.insert(id, stage)));
        }
    }

    fn on_record(&self, id: &Id, values: &Record<'_>, _: Context<'_, S>) {
        Self::update(id, |stages, id| {
            if let Some(stage) = stages.get_mut(&id) {
                values.record(stage);
            }
        });
    }

    fn on_close(&self, id: Id, _: Context<'_, S>) {
        Self::update(&id, |stages, id| {
            if let Some(bar) = stages.remove(&id).and_then(|stage| stage.bar) {
                bar.finish_and_clear();
            }
        });
    }
}

/// Shows stages from now on.
pub(crate) fn watch() {
    let is_terminal = std::io::stderr().is_terminal();
    let look = move || loop {
        thread::sleep(LOOK_EVERY);
        let mut stages = RUNNING_STAGES.lock().unwrap_or_else(PoisonError::into_inner);
        let lines: Vec<String> = stages.values_mut().filter_map(|stage| stage.shown(is_terminal)).collect();
        // The logger must not wait for itself.
        drop(stages);
        lines.iter().for_each(|line| tracing::info!("{line}"));
    };
    // Without a thread there is no progress, but the work continues.
    let _ = thread::Builder::new().name("stages".to_owned()).spawn(look);
}

#[cfg(test)]
mod tests {
    use super::{PLAIN_EVERY, RunningStage};
    use std::time::{Duration, Instant};

    #[test]
    fn a_line_comes_after_two_seconds_and_then_seldom() {
        let ago = |seconds: u64| Instant::now().checked_sub(Duration::from_secs(seconds)).expect("a clock that runs");
        let stage = |seconds, total| RunningStage {
            what: "reading photos".to_owned(),
            total,
            done: 3,
            start: ago(seconds),
            told: None,
            bar: None,
        };
        assert_eq!(stage(1, 9).shown(false), None);
        let mut long = stage(3, 9);
        assert_eq!(long.shown(false).as_deref(), Some("reading photos: 3 of 9"));
        assert_eq!(long.shown(false), None);
        let mut uncounted = stage(30, 0);
        assert_eq!(uncounted.shown(false).as_deref(), Some("reading photos"));
        uncounted.told = Some(ago(PLAIN_EVERY.as_secs() + 1));
        assert!(
            uncounted.shown(false).is_some_and(|line| line.starts_with("reading photos: 3") && line.ends_with("far"))
        );
    }
}
