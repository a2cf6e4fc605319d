//! Devices and drivers.

mod cards; // kernels compile for cards that are not there
mod drivers; // every subgroup size, and drivers other than the usual one
mod families;
mod few; // buffers that share bindings // what devices of each family get
