//! Integration tests in one binary. Without the feature `lab` those that inject faults or hide what a device has are
//! ignored.
#![allow(
    clippy::disallowed_methods,
    clippy::too_many_lines,
    reason = "the rules of files and lengths are those of the library"
)]

use labelgs::reference;

#[allow(dead_code, reason = "not every helper is always in use")]
mod support;

#[global_allocator]
static MEMORY: support::memory::Counting = support::memory::Counting;

mod architecture; // layers of the crate, file lengths, places of unsafe code
mod blocks; // a scene in blocks: frozen Gaussians, split, trained, merged
mod cli; // the program, as it is typed
mod engine; // a device with a model in its memory
mod eval; // scores of a model
mod gpu; // kernels of cards that are not there, drivers other than the usual one
mod guide; // every command of README.md and of the guide runs
mod hostile; // damaged and hostile files are refused in bounded memory
mod invariants; // results do not depend on kernel shape, threads or a resume
mod label; // labels from masks
mod pass; // each kernel against its mirror
mod records; // checkpoints and compiled pipelines
mod regressions; // failures that users of other trainers reported
mod render; // pictures of a model, as files
mod run; // a training from a folder to a folder
mod scenes; // faults of a capture, as the program tells them
mod scheduler; // barriers, memory, faults and recorded lists of GPU work
mod shaders; // the generator, and what each shader has to have
mod stress; // error bounds on adversarial scenes
mod tools; // scripts and packages
mod train; // trainings, by what they train and by which losses
mod verify; // mirrors, their gradients, the self-test
mod viewer;
mod words; // words that are not ours, names that say nothing // the server of the viewer, and its page in a browser
