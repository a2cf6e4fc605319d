//! The command line tool.

use std::alloc::{GlobalAlloc, Layout, System};
use std::io::Write;

/// No host has so many bytes. Who asks for more was told so by a file, and is left to say what is wrong with that.
const NOBODY_HAS: usize = 1 << 46;

/// The system's allocator. Where it has nothing left, the process ends with status 5 and a reason, as for memory of the
/// device; Rust's own way is to abort.
struct Host;

#[global_allocator]
static HOST: Host = Host;

// SAFETY: everything is left to the system's allocator.
unsafe impl GlobalAlloc for Host {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller keeps the contract, here and below.
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
        // Standard error has no buffer, so this needs no memory.
        let _ = writeln!(
            std::io::stderr(),
            "error: the memory of this computer ran out when {bytes} bytes were asked for; use smaller images \
             (--max-resolution), a lower --max-gaussians, or free memory"
        );
        signal_hook::low_level::exit(5);
    }
    memory
}

fn main() -> std::process::ExitCode {
    labelgs::internals::cli::main(std::env::args_os()).into()
}
