//! Integration tests, one binary.

mod cli;
mod config;
mod metrics;
mod output;
mod synth;
