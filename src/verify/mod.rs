//! The engine compared with the method in double precision, on the user's own device.

pub mod selftest;
