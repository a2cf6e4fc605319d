//! Support for tests and benchmarks: injected faults, and variables that make a device appear less capable. Both exist
//! only in builds with the feature `lab`. Elsewhere [`ON`] is false, and the compiler removes them.

pub mod fault;

/// Whether this build has the feature `lab`.
pub const ON: bool = cfg!(feature = "lab");

/// Reads an environment variable in builds with the feature `lab`; `None` if it is empty or in other builds.
#[inline(always)]
pub fn var(name: &str) -> Option<String> {
    if ON { std::env::var(name).ok().filter(|text| !text.is_empty()) } else { None }
}
