//! Integration tests, one binary; those of the program as it ships are in `shipped.rs`.
#![allow(
    clippy::disallowed_methods,
    clippy::too_many_lines,
    reason = "the rules of files and lengths are those of the library"
)]

use labelgs::internals::verify::reference;

#[allow(dead_code, reason = "helpers are shared by tests that come and go")]
mod support;

#[global_allocator]
static MEMORY: support::memory::Counting = support::memory::Counting;

mod architecture;
mod associate;
mod cli;
mod cli_devices;
mod cli_edit;
mod cli_faults;
mod cli_labels;
mod cli_long;
mod cli_masks;
mod cli_surroundings;
mod coarse;
mod compare_self;
mod config;
mod decide;
mod densify;
mod edits;
mod gradient;
mod hostile;
mod invariants;
mod io;
mod known;
mod labels;
mod metrics;
mod mirror_mutants;
mod mirrors;
mod observer;
mod occlusion;
mod output;
mod overflow;
mod pass;
mod protocol;
mod registry;
mod scheduler;
mod segments;
mod selftest;
mod sentinel;
mod shadergen;
mod shared;
mod strategy;
mod stress;
mod synth;
mod track;
