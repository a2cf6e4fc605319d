//! Messages on standard error, printed above the progress bars.

use crate::Error;
use crate::cli::support::args::GlobalArgs;
use crate::cli::support::stage_progress::{self, Stages};
use crate::stage::STAGE_TARGET;
use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::{IsTerminal, Write};
use std::sync::{LazyLock, Mutex};
use std::time::{Duration, Instant};
use tracing::Level;
use tracing::field::{Field, Visit};
use tracing_subscriber::filter::Targets;
use tracing_subscriber::layer::{Context, SubscriberExt};
use tracing_subscriber::util::SubscriberInitExt;
use tracing_subscriber::{EnvFilter, Layer};

/// All progress bars of the process.
static PROGRESS_BARS: LazyLock<MultiProgress> =
    LazyLock::new(|| MultiProgress::with_draw_target(ProgressDrawTarget::stderr_with_hz(10)));

/// Time before the first plain progress line, and between two.
pub(crate) const PLAIN_AFTER: Duration = Duration::from_secs(2);
pub(crate) const PLAIN_EVERY: Duration = Duration::from_secs(10);

/// Standard error. The bars are hidden during a write.
struct BarAwareStderr;

impl Write for BarAwareStderr {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        // A closed standard error must not end the work, and the logger would panic on an error.
        let _ = PROGRESS_BARS.suspend(|| std::io::stderr().write_all(bytes));
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// Maximum number of warnings kept.
const WARNINGS_MAX: usize = 2000;

/// The warnings of this process, for reports.
static KEPT_WARNINGS: Mutex<Vec<String>> = Mutex::new(Vec::new());

/// Returns the text of all warnings so far.
pub(crate) fn warnings() -> Vec<String> {
    KEPT_WARNINGS.lock().map(|kept| kept.clone()).unwrap_or_default()
}

/// Collects warnings.
struct WarningKeeper;

impl<S: tracing::Subscriber> Layer<S> for WarningKeeper {
    fn on_event(&self, event: &tracing::Event<'_>, _: Context<'_, S>) {
        struct Message(String);
        impl Visit for Message {
            fn record_debug(&mut self, field: &Field, value: &dyn std::fmt::Debug) {
                if field.name() == "message" {
                    self.0 = format!("{value:?}");
                }
            }
        }
        let mut message = Message(String::new());
        event.record(&mut message);
        if let Ok(mut kept) = KEPT_WARNINGS.lock()
            && kept.len() < WARNINGS_MAX
        {
            kept.push(message.0);
        }
    }
}

/// Starts logging; `RUST_LOG` overrides the flags. Later calls do nothing.
pub(crate) fn start(args: &GlobalArgs) {
    let level = match (args.quiet, args.verbose) {
        (true, _) => "error",
        (_, 0) => "warn,labelgs=info,labelgs::stage=off",
        (_, 1) => "warn,labelgs=debug,labelgs::stage=off",
        _ => "trace",
    };
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new(level));
    let colour = std::io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty());
    let shown = tracing_subscriber::fmt::layer().with_writer(|| BarAwareStderr).with_ansi(colour).with_target(false);
    let own = Targets::new().with_target("labelgs", Level::WARN);
    let started = tracing_subscriber::registry()
        .with(shown.without_time().with_filter(filter))
        .with(WarningKeeper.with_filter(own))
        .with((!args.quiet).then(|| Stages.with_filter(Targets::new().with_target(STAGE_TARGET, Level::INFO))))
        .try_init();
    // A second start in one process, as in tests, keeps the first logger.
    if started.is_ok() && !args.quiet {
        stage_progress::watch();
    }
}

/// Prints the error that ends the process, even with `--quiet`.
pub(crate) fn final_error(error: &Error) {
    PROGRESS_BARS.suspend(|| {
        // A closed standard error cannot be reported.
        let _ = writeln!(std::io::stderr(), "error: {error}");
    });
}

/// Adds a bar over `total` items beside a message; one that only turns if their number is not known.
pub(crate) fn bar(total: u64) -> ProgressBar {
    // Short, so that a line with bar and message fits 80 columns.
    let template = if total == 0 { "{spinner} {msg}" } else { "{bar:6} {msg}" };
    let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
    PROGRESS_BARS.add(ProgressBar::new(total).with_style(style))
}

/// Returns the progress of long work as text, for bars and lines. `rate` is in items per second.
pub(crate) fn told((done, total): (u64, u64), what: &str, rate: f64, more: &str) -> String {
    let mut text = format!("{done}/{total} {what}");
    if rate > 0.0 {
        let left = (total.saturating_sub(done) as f64 / rate).ceil() as u64;
        let left = match left {
            0..100 => format!("{left}s"),
            100..6000 => format!("{}m", left.div_ceil(60)),
            _ => format!("{}h", left.div_ceil(3600)),
        };
        text += &format!(", {rate:.1}/s, {left} left");
    }
    if more.is_empty() { text } else { format!("{text}, {more}") }
}

/// Progress of long work: a bar on a terminal, otherwise log lines, from [`PLAIN_AFTER`] on.
pub(crate) struct Progress {
    bar: Option<ProgressBar>,
    what: &'static str,
    total: u64,
    /// Items done before the first that this process did.
    first: Option<u64>,
    start: Instant,
    last: Instant,
    /// Time until the next line.
    wait: Duration,
}

impl Progress {
    /// Starts progress over `total` items called `what`, such as `steps`.
    pub(crate) fn new(total: u64, what: &'static str, args: &GlobalArgs) -> Self {
        let bar = (!args.quiet && std::io::stderr().is_terminal()).then(|| bar(total));
        let now = Instant::now();
        Self { bar, what, total, first: None, start: now, last: now, wait: PLAIN_AFTER }
    }

    /// Shows that `done` items are done. `message` adds details, such as the loss; it is only called when shown.
    pub(crate) fn set(&mut self, done: u64, message: impl FnOnce() -> String) {
        // In a resumed run, only the steps of this process count.
        let first = *self.first.get_or_insert(done.saturating_sub(1));
        let wait = if self.bar.is_some() { Duration::from_millis(100) } else { self.wait };
        if let Some(bar) = &self.bar {
            bar.set_position(done);
        }
        if self.last.elapsed() <= wait {
            return;
        }
        (self.last, self.wait) = (Instant::now(), PLAIN_EVERY);
        let rate = done.saturating_sub(first) as f64 / self.start.elapsed().as_secs_f64();
        let text = told((done, self.total), self.what, rate, &message());
        match &self.bar {
            Some(bar) => bar.set_message(text),
            None => tracing::info!("{text}"),
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
            PROGRESS_BARS.remove(bar);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::told;

    #[test]
    fn a_line_of_a_training_fits_beside_a_bar() {
        let more = "loss 0.123 + 0.045, 16.8k Gaussians";
        let line = told((12_345, 30_000), "steps", 39.44, more);
        assert_eq!(line, "12345/30000 steps, 39.4/s, 8m left, loss 0.123 + 0.045, 16.8k Gaussians");
        for rate in [0.3, 39.0, 402.1] {
            let line = told((12_345, 30_000), "steps", rate, more);
            assert!("123456 ".len() + line.len() <= 80, "{line}");
        }
        assert_eq!(told((5, 9), "pictures", 2.0, ""), "5/9 pictures, 2.0/s, 2s left");
        assert_eq!(told((0, 9), "pictures", 0.0, ""), "0/9 pictures");
    }
}
