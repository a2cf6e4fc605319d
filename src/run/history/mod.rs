//! `history.jsonl`: the metrics of a run over its steps, as lines of JSON.
//!
//! A line is written and flushed when its values are known, about every ten steps. A resumed run first drops the lines
//! after its checkpoint, which stores the sums of the unfinished line. An interrupted run thus has the same history as
//! an uninterrupted one, except for times.

mod entry;
mod read;

pub(crate) use entry::{Entry, Steps, Sums, ViewScore};
pub(crate) use read::read;

use crate::error::{Error, Result};
use crate::files::append::LineFile;
use crate::train::{DensifyCounts, StepReport, Trainer};
use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Name of the file.
pub(crate) const HISTORY_FILE: &str = "history.jsonl";

/// Steps per line.
pub(crate) const STEPS_PER_LINE: u32 = 10;

/// Writes the history of a run.
pub(super) struct Recorder {
    path: PathBuf,
    /// `None` if the file could not be opened.
    lines: Option<LineFile>,
    sums: Sums,
    /// Lines whose step reports are still missing.
    due: VecDeque<Steps>,
    /// Time spent in steps since the last line, and their number.
    spent: (Duration, u32),
    /// Seconds of the run before `start`.
    before: f64,
    start: Instant,
    has_warned: bool,
}

impl Recorder {
    /// Opens the history of a run of `last` steps in the folder `out` that resumes after `step`; 0 starts a new
    /// history.
    pub(super) fn new(out: &Path, (step, last): (u32, u32), sums: Sums) -> Self {
        let path = out.join(HISTORY_FILE);
        let (bytes, before) = kept_part(&path, step, last);
        let mut recorder = Self {
            lines: None,
            sums,
            due: VecDeque::new(),
            spent: (Duration::ZERO, 0),
            before,
            start: Instant::now(),
            has_warned: false,
            path,
        };
        match LineFile::open(&recorder.path, bytes) {
            Ok(lines) => recorder.lines = Some(lines),
            Err(error) => recorder.warn(&error),
        }
        recorder
    }

    /// Starts the clock, at the first step.
    pub(super) fn start(&mut self) {
        self.start = Instant::now();
    }

    /// Rewinds to `step` after a failure.
    pub(super) fn go_back(&mut self, step: u32, last: u32, sums: Sums) {
        let (bytes, _) = kept_part(&self.path, step, last);
        self.due.clear();
        (self.sums, self.spent) = (sums, (Duration::ZERO, 0));
        self.write(|lines| lines.cut(bytes));
    }

    /// Records a submitted step and its time.
    pub(super) fn submitted(&mut self, step: u32, is_last: bool, gaussians: u32, time: Duration) {
        self.spent = (self.spent.0 + time, self.spent.1 + 1);
        if step.is_multiple_of(STEPS_PER_LINE) || is_last {
            let ms = 1000.0 * self.spent.0.as_secs_f64() / f64::from(self.spent.1);
            self.spent = (Duration::ZERO, 0);
            let seconds = self.seconds();
            self.due.push_back(Steps { step, gaussians, ms, seconds, ..Steps::default() });
        }
    }

    /// Adds the reports of finished steps, in order.
    pub(super) fn finished(&mut self, reports: &[StepReport]) {
        for report in reports {
            self.sums.add(report);
            if self.due.front().is_none_or(|due| due.step != report.step) {
                continue;
            }
            let Some(due) = self.due.pop_front() else { continue };
            let line = std::mem::take(&mut self.sums).into_line(due);
            self.put(&Entry::Steps(line));
        }
    }

    /// Waits for all steps and adds their reports.
    pub(super) fn drain(&mut self, trainer: &mut Trainer) -> Result<()> {
        let reports = trainer.drain()?;
        self.finished(&reports);
        Ok(())
    }

    /// Returns the sums of the unfinished line, for a checkpoint. Nothing may be in flight.
    pub(super) fn unfinished(&self) -> Sums {
        self.sums
    }

    /// Adds a densification.
    pub(super) fn densified(&mut self, step: u32, what: DensifyCounts) {
        let DensifyCounts { cloned, split, pruned } = what;
        self.put(&Entry::Densified { step, cloned, split, pruned });
    }

    /// Adds a line.
    pub(super) fn put(&mut self, entry: &Entry) {
        match serde_json::to_string(entry) {
            Ok(text) => self.write(|lines| lines.add(&text)),
            Err(error) => self.warn(&Error::Bug(format!("history: {error}"))),
        }
    }

    /// Waits until all lines are on disk; call it before a checkpoint, which must not be ahead of the history.
    pub(super) fn sync(&mut self) {
        self.write(LineFile::sync);
    }

    /// Returns the training time so far, including earlier parts of an interrupted run, s.
    pub(super) fn seconds(&self) -> f64 {
        self.before + self.start.elapsed().as_secs_f64()
    }

    fn write(&mut self, what: impl FnOnce(&mut LineFile) -> Result<()>) {
        let Some(lines) = &mut self.lines else { return };
        if let Err(error) = what(lines) {
            self.warn(&error);
        }
    }

    /// The run is worth more than its history.
    fn warn(&mut self, error: &Error) {
        if !std::mem::replace(&mut self.has_warned, true) {
            tracing::warn!("{error}; training continues, but its report will have gaps");
        }
    }
}

/// Returns the length of the history up to `step` in bytes, and the seconds until then. A run that ended at `step` is
/// scored again, so its final scores are dropped.
fn kept_part(path: &Path, step: u32, last: u32) -> (u64, f64) {
    if step == 0 || !path.is_file() {
        return (0, 0.0);
    }
    let history = match read(path) {
        Ok(history) => history,
        Err(error) => {
            tracing::warn!("{error}; the history restarts after step {step}");
            return (0, 0.0);
        }
    };
    let stays = |entry: &Entry| entry.step() < step || entry.step() == step && !(entry.is_of_end() && step == last);
    let count = history.entries.iter().take_while(|entry| stays(entry)).count();
    let seconds =
        history.entries[..count].iter().filter_map(Entry::steps).map(|steps| steps.seconds).fold(0.0, f64::max);
    (history.ends.get(count.wrapping_sub(1)).copied().unwrap_or(0), seconds)
}
