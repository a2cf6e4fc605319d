//! The engine compared with the method in double precision: the mirrors, and the comparison on the user's own device.

pub mod reference;
pub mod selftest;
