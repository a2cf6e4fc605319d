//! Messages on standard error, printed above the progress bars.

use crate::Error;
use crate::cli::support::args::GlobalArgs;
use crate::cli::support::stage_progress::{self, Stages};
use crate::stage::TARGET;
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
static BARS: LazyLock<MultiProgress> =
    LazyLock::new(|| MultiProgress::with_draw_target(ProgressDrawTarget::stderr_with_hz(10)));

/// Time before the first plain progress line, and between two.
pub(crate) const PLAIN_AFTER: Duration = Duration::from_secs(2);
pub(crate) const PLAIN_EVERY: Duration = Duration::from_secs(10);

/// Standard error. The bars are hidden during a write.
struct AboveBars;

impl Write for AboveBars {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        // A closed standard error must not end the work, and the logger would panic on an error.
        let _ = BARS.suspend(|| std::io::stderr().write_all(bytes));
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// Most warnings that are kept.
const WARNINGS_MAX: usize = 2000;

/// The warnings of this process, for reports.
static WARNINGS: Mutex<Vec<String>> = Mutex::new(Vec::new());

/// Returns the text of all warnings so far.
pub(crate) fn warnings() -> Vec<String> {
    WARNINGS.lock().map(|kept| kept.clone()).unwrap_or_default()
}

/// Keeps warnings.
struct Keep;

impl<S: tracing::Subscriber> Layer<S> for Keep {
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
        if let Ok(mut kept) = WARNINGS.lock()
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
    let shown = tracing_subscriber::fmt::layer().with_writer(|| AboveBars).with_ansi(colour).with_target(false);
    let own = Targets::new().with_target("labelgs", Level::WARN);
    let started = tracing_subscriber::registry()
        .with(shown.without_time().with_filter(filter))
        .with(Keep.with_filter(own))
        .with((!args.quiet).then(|| Stages.with_filter(Targets::new().with_target(TARGET, Level::INFO))))
        .try_init();
    // A second start in one process, as in tests, keeps the first logger.
    if started.is_ok() && !args.quiet {
        stage_progress::watch();
    }
}

/// Prints the error that ends the process, even with `--quiet`.
pub(crate) fn final_error(error: &Error) {
    BARS.suspend(|| {
        // A closed standard error cannot be reported.
        let _ = writeln!(std::io::stderr(), "error: {error}");
    });
}

/// Adds a bar over `total` items called `what`; one that only turns if their number is not known.
pub(crate) fn bar(total: u64, what: String) -> ProgressBar {
    let template = match total {
        0 => "{spinner} {msg} {elapsed}",
        _ => "{bar:30} {pos}/{len} {msg} {per_sec} {eta} left",
    };
    let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
    BARS.add(ProgressBar::new(total).with_style(style).with_message(what))
}

/// Progress of long work: a bar on a terminal, otherwise log lines, from [`PLAIN_AFTER`] on.
pub(crate) struct Progress {
    bar: Option<ProgressBar>,
    what: &'static str,
    total: u64,
    start: Instant,
    last: Instant,
    /// Time until the next line.
    wait: Duration,
}

impl Progress {
    /// Starts progress over `total` items called `what`, such as `steps`.
    pub(crate) fn new(total: u64, what: &'static str, args: &GlobalArgs) -> Self {
        let bar = (!args.quiet && std::io::stderr().is_terminal()).then(|| bar(total, what.to_owned()));
        let now = Instant::now();
        Self { bar, what, total, start: now, last: now, wait: PLAIN_AFTER }
    }

    /// Shows that `done` items are done. `message` adds details, such as the loss; it is only called when shown.
    pub(crate) fn set(&mut self, done: u64, message: impl FnOnce() -> String) {
        if let Some(bar) = &self.bar {
            bar.set_position(done);
            if self.last.elapsed() > Duration::from_millis(100) {
                self.last = Instant::now();
                bar.set_message(format!("{} {}", self.what, message()));
            }
        } else if self.last.elapsed() > self.wait {
            (self.last, self.wait) = (Instant::now(), PLAIN_EVERY);
            let rate = done as f64 / self.start.elapsed().as_secs_f64();
            tracing::info!("{done} of {} {} ({rate:.1}/s) {}", self.total, self.what, message());
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
            BARS.remove(bar);
        }
    }
}
