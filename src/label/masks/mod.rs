//! Masks made to agree between views: by overlap from frame to frame, or by the Gaussians that they own.

pub(crate) mod agree;
pub(crate) mod associate;
pub(crate) mod repair;
pub(crate) mod track;

pub use agree::{Agreement, agree};
pub use repair::{Naming, Repairs};
pub use track::{Overlap, track};
