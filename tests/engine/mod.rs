//! A device with a model in its memory.

mod large; // models larger than the memory of the device, ids beyond those of masks
mod segments; // long splat lists are cut to bounded dispatches
