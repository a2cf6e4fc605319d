//! Integration tests, one binary.

mod cli;
mod config;
mod metrics;
mod synth;
