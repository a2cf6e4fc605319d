//! Integration tests, one binary.

mod sched;
mod support;
