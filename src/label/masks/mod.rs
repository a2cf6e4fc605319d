//! Masks made to agree between views: by overlap from frame to frame, or by the Gaussians that they own.

pub mod agree;
pub mod associate;
pub mod repair;
pub mod track;
