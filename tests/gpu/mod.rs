//! Devices and drivers.

mod cards; // kernels compile for cards that are not there
mod drivers; // every subgroup size, and drivers other than the usual one
mod families; // what devices of each family get
