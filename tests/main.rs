//! Integration tests, one binary.

mod shadergen;
