//! The program `labelgs`.

use std::alloc::{GlobalAlloc, Layout, System};
use std::io::Write;

/// Requests above this many bytes (64 TiB) come from corrupt length fields rather than a lack of memory. They fail
/// normally, so that the reader reports the file.
const PLAUSIBLE_ALLOCATION_MAX: usize = 1 << 46;

/// The system's allocator. If memory runs out, the process exits with status 5 and a message, as for device memory.
/// Rust's default is to abort.
struct Host;

#[global_allocator]
static ALLOCATOR: Host = Host;

// SAFETY: every call is forwarded to the system's allocator.
unsafe impl GlobalAlloc for Host {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller upholds the contract of `GlobalAlloc`, here and below.
        checked(unsafe { System.alloc(layout) }, layout.size())
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as above.
        checked(unsafe { System.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn realloc(&self, old: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: as above.
        checked(unsafe { System.realloc(old, layout, size) }, size)
    }

    unsafe fn dealloc(&self, old: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(old, layout) }
    }
}

/// Returns the allocator's result; exits if a plausible request failed.
fn checked(memory: *mut u8, bytes: usize) -> *mut u8 {
    if memory.is_null() && bytes < PLAUSIBLE_ALLOCATION_MAX {
        // Standard error is unbuffered, so this allocates no memory.
        let _ = writeln!(
            std::io::stderr(),
            "error: out of memory while allocating {bytes} bytes; use smaller images or fewer Gaussians, or free \
             memory"
        );
        signal_hook::low_level::exit(5);
    }
    memory
}

/// The commit that this program was built from, as `tools/setup` exports it. Only this file reads the variable, so that
/// a new commit does not recompile the library or the shaders.
const BUILD_COMMIT: Option<&str> = option_env!("LABELGS_COMMIT");

fn main() -> std::process::ExitCode {
    labelgs::cli::main(std::env::args_os(), BUILD_COMMIT).into()
}
