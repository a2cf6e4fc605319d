//! Untrusted input: hostile files and inconsistent scenes.

#[path = "../../tools/fuzz/readers.rs"]
mod readers;
#[path = "../../tools/fuzz/seeds.rs"]
mod seeds;
#[path = "../../tools/fuzz/targets.rs"]
mod targets;

mod bombs;
mod changed;
mod paths;
mod replay;
mod reports;
mod scenes;
mod trainings;
