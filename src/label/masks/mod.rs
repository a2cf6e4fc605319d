//! Makes masks agree between views: [`track`] connects video frames by overlap, [`agree()`] connects views through the
//! Gaussians of a model.

pub mod agree;
pub mod associate;
pub mod names;
pub mod nested;
pub mod repair;
pub(crate) mod track;

pub use agree::{Agreement, agree, follow};
pub use repair::{Naming, Repairs};
pub use track::{Overlap, track};
