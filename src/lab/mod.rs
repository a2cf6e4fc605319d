//! What is for tests and benchmarks alone: faults on purpose, and variables that make a device poorer than it is. Both
//! exist in builds with the feature `lab`; in the program that ships [`ON`] is false and the compiler leaves them out.

pub(crate) mod fault;

/// True in a build with the feature `lab`.
pub(crate) const ON: bool = cfg!(feature = "lab");

/// A variable of the environment that only a build with the feature `lab` reads; none if it is empty.
#[inline(always)]
pub(crate) fn var(name: &str) -> Option<String> {
    if ON { std::env::var(name).ok().filter(|text| !text.is_empty()) } else { None }
}
