//! Pictures of models that are larger than the memory of the device: each view takes the Gaussians that it may show.

mod index;
mod painter;

pub use index::GaussianIndex;
pub use painter::{Painter, fits};
