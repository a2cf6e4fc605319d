//! A Vulkan driver for tests, which runs compute shaders invocation by invocation and reports what a GPU may get wrong.
//!
//! Software drivers run the body of a skipped loop or branch under an empty mask, with its barriers. So a missing
//! barrier, or one that not all invocations reach, never shows on them. Here no invocation runs an instruction that its
//! own control flow does not reach.
//!
//! The loader finds the driver through a file such as this, in `VK_DRIVER_FILES`. [`driver`] lists its variables.
//!
//! ```json
//! {"file_format_version": "1.0.1", "ICD": {"library_path": "liblabelgs_checker.so", "api_version": "1.3.0"}}
//! ```
//!
//! # Findings
//!
//! | kind | what is reported |
//! | --- | --- |
//! | barrier | invocations of a workgroup wait at different barriers, or some have ended |
//! | shared race | two invocations access a word of shared memory with no barrier between, and one writes |
//! | buffer race | the same of a word of a buffer, in no order; an atomic and a plain access conflict too |
//! | coherence | in order, but not both through a `coherent` buffer |
//! | fence | invocations of a workgroup run different `memoryBarrier*()` between two barriers |
//! | subgroup | a subgroup operation that not all lanes of the subgroup reach |
//! | unwritten, stale | a read of shared memory, or of device memory, that nobody has written |
//! | bounds | an index beyond an array, or a place beyond a buffer |
//!
//! A message names the kernel, the SPIR-V instruction, counted from the first label of the function, and invocations.
//! It goes to stderr and to a log, once for each kind and instruction. The submit fails: the device is lost.
//!
//! # The model
//!
//! * Subgroups have one size for the whole device. Workgroups run in random order, four at a time. A seed decides; the
//!   same seed gives the same run. Subgroups are interleaved where they wait, and at atomics on buffers.
//! * Races are found by order, not by luck: two accesses conflict if no chain of barriers, fences and atomics leads
//!   from one to the other, however they fell in this run. The module `lane` says which chains count. They are those of the
//!   Vulkan memory model: `barrier()` of GLSL orders shared memory only.
//! * Arithmetic is that of [`ops`]: one rounding for each operation, no contraction.
//!
//! # What it cannot show
//!
//! * Barriers in a loop that invocations reach in different rounds, but equally often.
//! * Missing pipeline barriers between dispatches: everything is ordered there. The planner has its own tests.
//! * Faults of paths that the data of a test do not take.
//! * What compilers do: contraction, flushed denormals, the reconvergence that a driver really has.
//!
//! Where to start reading: [`program`] has the instructions, [`lower`] makes them from SPIR-V, [`machine`] runs them.
#![allow(unsafe_code)]
#![allow(clippy::disallowed_methods, reason = "the rules of files are those of the library")]

pub mod driver;
pub mod findings;
mod lane;
pub mod lower;
pub mod machine;
pub mod memory;
pub mod ops;
pub mod program;
pub mod races;
mod shared;
