//! Tests of synthetic scenes.
#![allow(
    clippy::disallowed_methods,
    clippy::too_many_lines,
    reason = "the rules of files and lengths are those of the library"
)]

mod city; // many objects, seen by several photos everywhere
mod truth; // pictures, masks, depths and points agree
mod turntable; // an object that is turned before a wall that stays
