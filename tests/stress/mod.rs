//! Scenes that strain f32 arithmetic, each with an error bound and its reason.

mod adversaries;
mod places;
