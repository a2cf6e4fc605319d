//! Scenes, with the program; readers have their tests in `src/scenes/tests`.

mod capture; // faults of photos and poses are found before training
#[path = "../../src/scenes/tests/fixtures.rs"]
#[allow(dead_code, reason = "tests of readers use the rest")]
pub mod fixtures;
