//! Masks that agree between views: [`track`] connects frames of a video by overlap, [`agree()`] connects views by the
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
