//! Selects Gaussians by hand: by a shape drawn over a render, by distance, by similarity, or by neighbourhood.
//!
//! Each rule returns a selection with one flag per row of the model; [`Combine`] combines it with the previous one.

mod nearby;
mod region;

pub use nearby::Nearby;
pub(crate) use nearby::{colour, normal};
pub use region::{Region, Shape, Side, beyond, in_region, in_sphere};

use serde::Deserialize;

/// How a new selection combines with the previous one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Combine {
    /// Replaces it.
    #[default]
    Replace,
    /// Adds to it.
    Add,
    /// Subtracts from it.
    Take,
    /// Keeps only what both contain.
    Within,
}

impl Combine {
    /// Returns the combined selection.
    pub fn join(self, before: &[bool], found: &[bool]) -> Vec<bool> {
        let join = |(&before, &found): (&bool, &bool)| match self {
            Self::Replace => found,
            Self::Add => before || found,
            Self::Take => before && !found,
            Self::Within => before && found,
        };
        before.iter().zip(found).map(join).collect()
    }
}
