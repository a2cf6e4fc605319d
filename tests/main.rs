//! Integration tests, one binary.

mod config;
mod metrics;
mod shadergen;
mod synth;
