//! Tests of the first Gaussians.
