//! The interpreter on small shaders: faults that were planted, their mended twins, and arithmetic.

mod buffers;
mod faults;
mod numbers;
mod support;
