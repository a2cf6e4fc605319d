//! Integration tests of the program as it ships, without the feature `lab`. With that feature the binary is empty.
#![cfg(not(feature = "lab"))]
#![allow(
    clippy::disallowed_methods,
    clippy::too_many_lines,
    reason = "the rules of files and lengths are those of the library"
)]

#[allow(dead_code, reason = "helpers are shared with the other binary")]
mod support {
    pub mod device;
    pub mod runs;
    pub use device::device;
}

mod cli_engine; // commands with a device, from a made scene to pictures
mod cli_kills; // killed exports leave whole files
mod cli_resume; // killed, stopped and damaged runs resume to the same bits
mod cli_reuse; // a trained model begins another training, or becomes simpler
mod ignored; // the shipped program has no fault injection
mod output; // files of rendered pictures
mod package; // manual pages and completions of every command, and the version
mod pipeline; // from photos to an object, with a segmenter in Python
#[path = "scheduler/plan/mod.rs"]
mod plan; // barriers and memory of the lists without `lab`
mod registry; // every shader without `lab` has a header, a mirror and a pass
