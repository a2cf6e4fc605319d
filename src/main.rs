//! The program `labelgs`.

use std::alloc::{GlobalAlloc, Layout, System};
use std::io::Write;

/// Bytes (64 TiB) above which a request comes from a number in a damaged file, not from a lack of memory: no computer
/// has as much. It fails like any other, and the reader of the file reports it.
const PLAUSIBLE_ALLOCATION_MAX: usize = 1 << 46;

/// The system's allocator. If memory runs out, the process ends with status 5 and a message, as for device memory; by
/// default Rust aborts.
struct Host;

#[global_allocator]
static ALLOCATOR: Host = Host;

// SAFETY: every call goes to the system's allocator.
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

/// Returns what the allocator returned; ends the process if that is none of a plausible number of bytes.
fn checked(memory: *mut u8, bytes: usize) -> *mut u8 {
    if memory.is_null() && bytes < PLAUSIBLE_ALLOCATION_MAX {
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

/// The commit that this program was built from, as `tools/setup` exports it. Only this file reads the variable, so that
/// a commit compiles neither library nor shaders anew.
const BUILD_COMMIT: Option<&str> = option_env!("LABELGS_COMMIT");

fn main() -> std::process::ExitCode {
    labelgs::cli::main(std::env::args_os(), BUILD_COMMIT).into()
}
