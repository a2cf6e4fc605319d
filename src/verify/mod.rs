//! Compares the engine with a double-precision reference, on the user's device.

pub mod selftest;
