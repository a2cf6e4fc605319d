//! The program `labelgs`.

use std::alloc::{GlobalAlloc, Layout, System};
use std::io::Write;

/// No computer has this many bytes. A larger request comes from a damaged file; its reader reports the file.
const NOBODY_HAS: usize = 1 << 46;

/// The system's allocator. If memory runs out, the process ends with status 5 and a message, as for device memory; by
/// default Rust aborts.
struct Host;

#[global_allocator]
static HOST: Host = Host;

// SAFETY: every call goes to the system's allocator.
unsafe impl GlobalAlloc for Host {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller upholds the contract of `GlobalAlloc`, here and below.
        given(unsafe { System.alloc(layout) }, layout.size())
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as above.
        given(unsafe { System.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn realloc(&self, old: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: as above.
        given(unsafe { System.realloc(old, layout, size) }, size)
    }

    unsafe fn dealloc(&self, old: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(old, layout) }
    }
}

fn given(memory: *mut u8, bytes: usize) -> *mut u8 {
    if memory.is_null() && bytes < NOBODY_HAS {
        // Standard error is unbuffered, so this allocates no memory.
        let _ = writeln!(
            std::io::stderr(),
            "error: this computer has no memory left for {bytes} more bytes; use smaller images or \
             fewer Gaussians, or free memory"
        );
        signal_hook::low_level::exit(5);
    }
    memory
}

// `LOG`: git's log of HEAD, or a line of its form.
include!(concat!(env!("OUT_DIR"), "/commit.rs"));

/// Digits of a commit that are shown, as many as tell any two apart.
const DIGITS: usize = 12;
/// A copy, so that nothing else of the log is in the program.
const NEWEST: Option<[u8; DIGITS]> = newest(LOG);

/// The commit that this program was built from: as the environment of the build says, else the newest in git's log.
const COMMIT: Option<&str> = match (option_env!("LABELGS_COMMIT"), &NEWEST) {
    (Some(said), _) => Some(said),
    (None, Some(digits)) => match std::str::from_utf8(digits) {
        Ok(digits) => Some(digits),
        Err(_) => None,
    },
    (None, None) => None,
};

/// Returns the digits in the second word of the last line.
const fn newest(log: &[u8]) -> Option<[u8; DIGITS]> {
    let mut at = log.len().saturating_sub(1);
    while at > 0 && log[at - 1] != b'\n' {
        at -= 1;
    }
    while at < log.len() && log[at] != b' ' {
        at += 1;
    }
    let mut digits = [0; DIGITS];
    let mut count = 0;
    while count < DIGITS {
        at += 1;
        if at >= log.len() || !log[at].is_ascii_hexdigit() {
            return None;
        }
        digits[count] = log[at];
        count += 1;
    }
    Some(digits)
}

fn main() -> std::process::ExitCode {
    labelgs::internals::cli::main(std::env::args_os(), COMMIT).into()
}
