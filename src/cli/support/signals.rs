//! Signals. By default the first one ends the process; a command with unsaved work asks for [`note_only`].

use crate::{Error, Result};
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, LazyLock};

/// Exit status after SIGINT.
const SIGINT_STATUS: i32 = 130;

/// True while the next signal ends the process at once.
static AT_ONCE: LazyLock<Arc<AtomicBool>> = LazyLock::new(|| Arc::new(AtomicBool::new(true)));
/// Exit status of the signal that came, or 0.
static SIGNAL_STATUS: LazyLock<Arc<AtomicUsize>> = LazyLock::new(|| Arc::new(AtomicUsize::new(0)));

/// Installs the signal handlers. Their order matters: the first signal is noted and arms the exit, the second exits.
pub(crate) fn install() -> Result<()> {
    for (signal, status) in [(SIGINT, SIGINT_STATUS), (SIGTERM, 143)] {
        flag::register_conditional_shutdown(signal, status, Arc::clone(&AT_ONCE))
            .and_then(|_| flag::register_usize(signal, Arc::clone(&SIGNAL_STATUS), status as usize))
            .and_then(|_| flag::register(signal, Arc::clone(&AT_ONCE)))
            .map_err(|error| Error::Bug(format!("signal handler: {error}")))?;
    }
    Ok(())
}

/// Makes the first signal only noted; the caller polls [`check`]. A second signal ends the process.
pub(crate) fn note_only() {
    AT_ONCE.store(false, Ordering::SeqCst);
}

/// Makes the next signal end the process again, when there is no unsaved work. Fails if one came before.
pub(crate) fn end_at_once() -> Result<()> {
    AT_ONCE.store(true, Ordering::SeqCst);
    check()
}

/// Returns true if a signal came.
pub(crate) fn is_noted() -> bool {
    SIGNAL_STATUS.load(Ordering::SeqCst) != 0
}

/// Returns the exit status of an interrupted process: that of the signal that came, or that of SIGINT.
pub(crate) fn status() -> i32 {
    match SIGNAL_STATUS.load(Ordering::SeqCst) {
        0 => SIGINT_STATUS,
        status => i32::try_from(status).unwrap_or(SIGINT_STATUS),
    }
}

/// Fails if a signal came.
pub(crate) fn check() -> Result<()> {
    if is_noted() { Err(Error::Interrupted) } else { Ok(()) }
}
