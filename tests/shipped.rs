//! Integration tests of the program as it ships, without the feature `lab`; with that feature this is empty.
#![cfg(not(feature = "lab"))]
#![allow(
    clippy::disallowed_methods,
    clippy::too_many_lines,
    reason = "the rules of files and lengths are those of the library"
)]

#[allow(dead_code, reason = "helpers are shared with the other binary")]
mod support {
    pub mod device;
    pub mod runs;
    pub use device::device;
}

mod cli_engine;
mod cli_kills;
mod cli_resume;
mod ignored;
mod output;
#[path = "scheduler/plan/mod.rs"]
mod plan;
mod registry;
