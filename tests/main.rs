//! Integration tests, one binary.

mod io;
