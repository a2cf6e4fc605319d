//! Draws models that are larger than device memory: each view loads only the Gaussians that it may show.

mod index;
mod painter;

pub use index::GaussianIndex;
pub use painter::{Painter, fits};
