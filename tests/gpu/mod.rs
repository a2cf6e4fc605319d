//! Devices and drivers.

mod cards; // kernels compile for cards that are not there
mod checker; // kernels run invocation by invocation
mod drivers; // every subgroup size, and drivers other than the usual one
mod families;
mod few; // buffers that share bindings // what devices of each family get
