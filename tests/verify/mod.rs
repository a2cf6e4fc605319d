//! The method in f64, and comparisons with it.

mod axes; // models in other axes, and turned ones, keep their harmonics
mod comparisons; // the comparisons of all other tests do fail
mod constants; // the reference has the constants of the shaders
pub mod gradient; // gradients of the f64 mirrors, which the kernels are compared with
mod lazy; // missed updates at once equal those of every step
mod mirrors; // mirrors against closed forms and brute force
mod moments; // packed moments are right in the mean of many updates
mod mutants; // a wrong constant in a mirror fails its checks
mod selftest; // `labelgs selftest` passes, and detects each fault
